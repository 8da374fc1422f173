"""The wheel and the source distribution: the same bytes each time, with all that a robot needs."""

from __future__ import annotations

import json
import subprocess
import zipfile
from hashlib import sha256
from pathlib import Path

import pytest

from release.build import build
from tests.commands import SEVERAL
from tests.packaging.builds import (
    LONG,
    NODE_MODULES,
    VERSIONS,
    environment_like_ours,
    environment_of,
    pip,
    python_of,
    without_ours,
)
from tests.soak import rare

pytestmark = pytest.mark.timeout(LONG)


def digests(folder: Path) -> dict[str, str]:
    return {path.name: sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()}


@pytest.mark.parametrize("modules", [NODE_MODULES if NODE_MODULES.exists() else None, None])
@pytest.mark.soak
def test_who_builds_when_and_where_makes_no_difference(built: Path, tmp_path: Path, modules: Path | None) -> None:
    other = {"TZ": "Asia/Tokyo", "PYTHONHASHSEED": "7", "LC_ALL": "C"}
    assert build(tmp_path / "out", umask=0o077, environment=other, node_modules=modules) == digests(built)


@pytest.mark.soak
def test_the_source_distribution_makes_the_same_wheel(built: Path, wheel: Path, tmp_path: Path) -> None:
    [packed] = built.glob("*.tar.gz")
    (tmp_path / "source").mkdir()
    subprocess.run(["tar", "-xf", packed, "-C", tmp_path / "source"], check=True)
    [source] = (tmp_path / "source").iterdir()
    assert build(tmp_path / "out", source=source, wheel_only=True)[wheel.name] == digests(built)[wheel.name]


@pytest.mark.soak
def test_a_date_of_ones_own_is_the_date_of_every_file(tmp_path: Path) -> None:
    day = str(1_700_000_000)  # 14 November 2023
    [name] = build(tmp_path, environment={"SOURCE_DATE_EPOCH": day}, wheel_only=True)
    with zipfile.ZipFile(tmp_path / name) as archive:
        assert {each.date_time[:3] for each in archive.infolist()} == {(2023, 11, 14)}


def test_the_wheel_has_the_package_the_library_and_the_pages_and_no_tests(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    for wanted in ("py.typed", "library/robots/turtlebot/robot.yaml", "library/docs/language.md", "msgs/std_msgs.pyi"):
        assert f"rbxcompose/{wanted}" in names
    assert any(name.endswith(".data/data/share/man/man1/rbxcompose.1") for name in names)
    tops = {name.partition("/")[0] for name in names}
    assert {top for top in tops if not top.startswith("rbxcompose-")} == {"rbxcompose"}
    assert not any(name.endswith((".pyc", ".lock")) for name in names)


@pytest.mark.parametrize("version", ["ours", *rare(*VERSIONS)])
def test_the_wheel_alone_makes_checks_and_runs_a_robot(wheel: Path, tmp_path: Path, version: str) -> None:
    folder = tmp_path / "environment"
    python = environment_like_ours(folder) if version == "ours" else environment_of(python_of(version), folder)
    # The locked packages are all that it asks for.
    done = pip(python, "install", "--no-index", "--no-compile", str(wheel))
    assert done.returncode == 0, done.stderr
    (empty := tmp_path / "empty").mkdir()
    new_and_check = [str(python), "-c", SEVERAL, json.dumps([["new", "robot", "x", "--yes"], ["check"]])]
    up = [str(python.with_name("rbxcompose")), "up", "--for", "1s", "--rate", "max"]
    for words, wanted in ((new_and_check, "x is fine"), (up, "")):
        said = subprocess.run(words, cwd=empty, env=without_ours(tmp_path), capture_output=True, text=True, check=False)
        assert said.returncode == 0, said.stdout + said.stderr
        assert wanted in said.stdout
    assert "x is down: the time is up" in said.stdout + said.stderr


def test_a_python_that_is_too_old_is_refused(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        [metadata] = [name for name in archive.namelist() if name.endswith("/METADATA")]
        assert f"Requires-Python: >={VERSIONS[0]}" in archive.read(metadata).decode()
