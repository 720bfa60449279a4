"""`python -m mirrorbake` is the command `mirrorbake`."""

from mirrorbake.cli import main

if __name__ == "__main__":
    main()
