"""`python -m mirrorbake` is the command `mirrorbake`."""

from mirrorbake.commands.main import main

if __name__ == "__main__":
    main()
