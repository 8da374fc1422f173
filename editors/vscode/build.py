"""Builds the extension for VS Code, `build/rbxcompose.vsix`: `python editors/vscode/build.py`, or `make vscode`.

Needs npm, as the console's page does, whose build runs it.
"""

from __future__ import annotations

import fcntl
import runpy
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BUILT = ROOT / "build/rbxcompose.vsix"
LOCK = ROOT / "build/vscode.lock"

_console = runpy.run_path(str(ROOT / "console/build.py"))
CannotBuildError: type[RuntimeError] = _console["CannotBuildError"]


def is_built() -> bool:
    """Return whether the extension is newer than its sources."""
    made = [path for path in HERE.iterdir() if path.is_file()] + list((HERE / "src").iterdir())
    return BUILT.exists() and all(path.stat().st_mtime <= BUILT.stat().st_mtime for path in made)


def build() -> None:
    """Build the extension unless it is built; of several processes, one does.

    Raises:
        CannotBuildError: if that is impossible here.
    """
    BUILT.parent.mkdir(exist_ok=True)
    with LOCK.open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if is_built():
            return
        _console["install"](HERE)
        _console["npm"]("run", "build", folder=HERE)
        _console["npm"]("run", "package", "--", "--out", str(BUILT), folder=HERE)


if __name__ == "__main__":
    try:
        build()
    except CannotBuildError as error:
        sys.exit(f"the extension was not built: {error}")
