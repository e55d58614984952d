"""`python -m iowbc`: the same as the command `iowbc`."""

from iowbc.cli import main

if __name__ == "__main__":
    main()
