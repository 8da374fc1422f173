"""A new component type is a distribution: found once it is installed, right from the start."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from rbxcompose.commands.new_files import write_new
from rbxcompose.testing import Golden
from rbxcompose.tools.scaffold import component_files, read_component_name
from tests.forked import Forked

ROBOT = """
rbx: 1
kind: Robot
name: example
components:
  one:
    type: thermo_meter
    {setting}: 20 %
diagnostics:
  analyzers:
    all:
      match: ["*"]
"""


def run(folder: Path, *words: str, path: str = "", **variables: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": path, **variables}
    command = [sys.executable, "-m", *words]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def installed(folder: Path) -> str:
    """Do what `pip install -e` does: its folder on the path, and its entry points beside it."""
    write_new(folder, component_files(read_component_name("thermo_meter")))
    project = tomllib.loads((folder / "thermo_meter/pyproject.toml").read_text(encoding="utf-8"))["project"]
    points = project["entry-points"]["rbxcompose.plugins"]
    info = folder / "site/thermo_meter-0.1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    lines = [f"{name} = {module}" for name, module in points.items()]
    (info / "entry_points.txt").write_text("\n".join(["[rbxcompose.plugins]", *lines, ""]))
    return f"{folder / 'site'}{os.pathsep}{folder / 'thermo_meter'}"


def test_it_is_written_as_people_would_write_it(golden: Golden) -> None:
    for name, text in component_files("thermo_meter").items():
        golden.check(f"component/{name}.txt", text)


def test_its_own_test_passes_before_it_is_installed(tmp_path: Path) -> None:
    write_new(tmp_path, component_files("thermo_meter"))
    words = [sys.executable, str(Path(pytest.__file__).with_name("__main__.py")), "-q", "-p", "no:cacheprovider"]
    environment = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    with Forked(
        words, cwd=tmp_path / "thermo_meter", env=environment, stdin=-3, stdout=-1, stderr=-2, text=True
    ) as done:
        said, _ = done.communicate(timeout=60.0)
    assert "2 passed" in said, said


def test_installed_it_is_a_type_like_any_other(tmp_path: Path) -> None:
    path = installed(tmp_path)
    for setting in ("weight", "wieght"):
        (tmp_path / f"{setting}.yaml").write_text(ROBOT.format(setting=setting), encoding="utf-8")
    told = run(tmp_path, "rbxcompose", "check", "--strict", "weight.yaml", "wieght.yaml", path=path).stdout
    assert "did you mean 'weight'?" in told
    assert told.endswith("\n1 error; it can be fixed with 'check --fix'\n"), "the other one is fine"


@pytest.mark.soak  # that suite tries all types that ship, and one of somebody else
def test_it_keeps_what_every_type_keeps(tmp_path: Path) -> None:
    path = installed(tmp_path)
    suite = Path(__file__).parents[1] / "components/test_conformance.py"
    words = (
        "-q",
        "-p",
        "no:cacheprovider",
        "--rootdir",
        str(suite.parent),
    )  # without tests/conftest.py, which compiles
    done = run(suite.parents[2], "pytest", *words, "-k", "thermo_meter", str(suite), path=path)
    assert done.returncode == 0, done.stdout
    assert " passed" in done.stdout


def test_it_is_typed_and_formatted_as_ours(tmp_path: Path) -> None:
    write_new(tmp_path, component_files("thermo_meter"))
    done = run(
        tmp_path,
        "ruff",
        "check",
        "--isolated",
        "--select",
        "D1,E,F,I,UP,B",
        "--line-length",
        "120",
        "thermo_meter/thermo_meter.py",
    )
    assert done.returncode == 0, done.stdout
    done = run(tmp_path, "ruff", "format", "--isolated", "--check", "--line-length", "120", "thermo_meter")
    assert done.returncode == 0, done.stdout
