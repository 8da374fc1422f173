"""The command `rbxcompose`, also as `python -m rbxcompose`."""

import signal
import sys


def main() -> int:
    """Run the command and return its exit code; Ctrl-C ends it silently even while it is imported."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from rbxcompose.commands.main import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
