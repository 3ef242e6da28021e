"""``python -m chaincor``: the command line."""

from chaincor.workflows.cli import main

if __name__ == "__main__":
    main()
