"""The wheel that these tests install, built once, and the Pythons of this machine."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from functools import cache
from importlib.metadata import distribution
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LOCK = ROOT / "requirements.lock"
NODE_MODULES = ROOT / "console/node_modules"
VERSIONS = ("3.11", "3.12", "3.13", "3.14")
LONG = 500.0  # [s]


@cache
def python_of(version: str) -> str:
    """Return the program of a version of Python, or skip the test with the reason."""
    installed = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"), "versions")
    candidates = [
        shutil.which(f"python{version}"),
        *map(str, sorted(installed.glob(f"{version}.*/bin/python"), reverse=True)),
    ]
    for program in filter(None, candidates):
        script = "import sys; print(sys.version.split()[0], sys.prefix == sys.base_prefix)"
        said = subprocess.run([program, "-c", script], capture_output=True, text=True, check=False).stdout
        if said.startswith(f"{version}."):
            return program
    pytest.skip(f"there is no Python {version} here")


def without_ours(folder: Path) -> dict[str, str]:
    """Return an environment in which nothing of this checkout is found, and whose state is in a folder."""
    (run := folder / "run").mkdir(mode=0o700, exist_ok=True)
    there = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    return {**there, "XDG_RUNTIME_DIR": str(run), "XDG_CACHE_HOME": str(folder / "cache")}


def pip(program: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run our pip for an environment, which needs none of its own."""
    command = [sys.executable, "-m", "pip", "--python", str(program), "-q", "--disable-pip-version-check", *words]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def environment_like_ours(folder: Path) -> Path:
    """Return the program of a new environment with the locked packages: links to ours if those are the same."""
    locked = re.findall(r"^(\S+)==(\S+)", LOCK.read_text(encoding="utf-8"), re.MULTILINE)
    ours = [distribution(name) for name, _ in locked]
    if [one.version for one in ours] != [version for _, version in locked]:
        return environment_of(sys.executable, folder)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    [packages] = folder.glob("lib/python*/site-packages")
    for one in ours:
        for top in {file.parts[0] for file in one.files or ()} - {".."}:
            (packages / top).symlink_to(Path(str(one.locate_file(top))))
    return folder / "bin" / "python"


def environment_of(python: str, folder: Path) -> Path:
    """Return the program of a new environment with the locked packages, or skip the test with the reason."""
    subprocess.run([python, "-m", "venv", "--without-pip", str(folder)], check=True)
    program = folder / "bin" / "python"
    done = pip(program, "install", "--no-compile", "--require-hashes", "-r", str(LOCK))
    if done.returncode != 0:
        pytest.skip(f"the packages cannot be had here: {done.stderr.strip().splitlines()[-1]}")
    return program
