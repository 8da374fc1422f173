"""The wheel in environments that other programs make: uvx and pipx."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.packaging.builds import LONG, pip, without_ours
from tests.patrol_project import write_project

pytestmark = [pytest.mark.soak, pytest.mark.timeout(LONG)]


def program(name: str, package: str, folder: Path) -> str:
    """Return the path of a program, installed into a folder if need be, or skip the test with the reason."""
    if found := shutil.which(name):
        return found
    subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    done = pip(folder / "bin" / "python", "install", package)
    if done.returncode != 0:
        pytest.skip(f"{package} cannot be had here: {done.stderr.strip().splitlines()[-1]}")
    return str(folder / "bin" / name)


@pytest.mark.parametrize(
    ("name", "package", "words"), [("uvx", "uv", ["--from"]), ("pipx", "pipx", ["run", "--spec"])], ids=["uvx", "pipx"]
)
def test_a_project_is_checked_without_an_installation(
    name: str, package: str, words: list[str], wheel: Path, tmp_path: Path
) -> None:
    runner = program(name, package, tmp_path / "environment")
    write_project(project := tmp_path / "project")
    folders = {"UV_CACHE_DIR": "uv", "UV_TOOL_DIR": "uv_tools", "PIPX_HOME": "pipx", "PIPX_BIN_DIR": "pipx_bin"}
    environment = without_ours(tmp_path) | {key: str(tmp_path / value) for key, value in folders.items()}
    environment |= {"UV_PYTHON": sys.executable, "PIPX_DEFAULT_PYTHON": sys.executable}
    command = [runner, *words, str(wheel), "rbxcompose", "check"]
    done = subprocess.run(command, cwd=project, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "turtlebot is fine" in done.stdout + done.stderr
