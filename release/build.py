"""Builds the wheel and the source distribution from the files that git knows: `python -m release.build FOLDER`.

The same files make the same bytes, whenever and wherever: names are sorted, times are `SOURCE_DATE_EPOCH` or a fixed
date, and modes do not depend on the umask. What is not committed cannot get in.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "dist"
NOT_BUILT = ("tests/", "benchmarks/")  # large, and in neither


class BuildError(RuntimeError):
    """Raised, with what the build said, if it failed."""


def tracked() -> list[str]:
    """Return the paths of the files that git knows and that are still there."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [path for path in listed.split("\0") if path and (ROOT / path).is_file()]


def copy_tracked(to: Path) -> None:
    """Copy what a build reads."""
    for path in tracked():
        if not path.startswith(NOT_BUILT):
            (to / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / path, to / path)
            os.utime(to / path, (when := (ROOT / path).stat().st_mtime, when))


def build(
    out: Path,
    *,
    source: Path | None = None,
    umask: int = 0o022,
    environment: Mapping[str, str] = {},
    wheel_only: bool = False,
    node_modules: Path | None = None,
    page: Path | None = None,
) -> dict[str, str]:
    """Build into a folder; return the SHA-256 of each file by its name.

    `source` is an unpacked source distribution; else a copy of the files that git knows is built. `node_modules` are
    those of the console, installed already, and `page` is what was built of it: each takes as long as all the rest.

    Raises:
        BuildError: if that failed.
    """
    out = out.resolve()
    with tempfile.TemporaryDirectory(prefix="rbxcompose_build_") as folder:
        copy = source or Path(folder, "rbxcompose")
        if source is None:
            copy_tracked(copy)
            if node_modules is not None:
                (copy / "console/node_modules").symlink_to(node_modules)
            if page is not None:
                shutil.copytree(page, copy / page.relative_to(ROOT))
        command = [sys.executable, "-m", "hatchling", "build", "-d", str(out), *(["-t", "wheel"] if wheel_only else [])]
        done = subprocess.run(
            command,
            cwd=copy,
            env={**os.environ, **environment},
            umask=umask,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
    if done.returncode != 0:
        raise BuildError(done.stdout)
    built = sorted(path for path in out.iterdir() if path.name.endswith((".whl", ".tar.gz")))
    return {path.name: sha256(path.read_bytes()).hexdigest() for path in built}


def main() -> None:
    """Build, and print the hashes as `sha256sum` does."""
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else OUT
    for name, digest in build(out).items():
        sys.stdout.write(f"{digest}  {name}\n")


if __name__ == "__main__":
    main()
