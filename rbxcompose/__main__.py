"""Lets `python -m rbxcompose` do what `rbxcompose` does."""

import sys

from rbxcompose.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
