"""The command `mirrorbake`, one module per subcommand."""
