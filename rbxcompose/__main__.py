"""Makes `python -m rbxcompose` the same as `rbxcompose`."""

import sys

from rbxcompose.commands.main import main

if __name__ == "__main__":
    sys.exit(main())
