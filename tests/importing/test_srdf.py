"""An SRDF becomes arms and a file of pairs; what is exported of them is imported as the same."""

from __future__ import annotations

import shutil
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

import pytest

from rbxcompose.body.link_pairs import digest_of
from rbxcompose.body.srdf import Semantics
from rbxcompose.compiler import Compilation, compile_robot
from rbxcompose.exporting.srdf import exported, semantics_of
from rbxcompose.testing.golden import Golden
from tests.conftest import ROOT
from tests.importing.imports import EXAMPLES, Imported, import_files

LIFTER = [EXAMPLES / f"srdf/lifter.{end}" for end in ("srdf", "urdf")]


def compiled(folder: Path, made: Imported, urdf: Path) -> Compilation:
    """Compile what was imported, beside its URDF."""
    folder.mkdir(exist_ok=True)
    shutil.copy(urdf, folder)
    for name, text in {"robot.yaml": made.text, **made.beside}.items():
        (folder / name).write_text(text)
    return compile_robot(str(folder / "robot.yaml"), environment={})


def said(compilation: Compilation) -> Semantics:
    assert compilation.robot is not None
    return semantics_of(compilation.robot.manifest.contents, "")


def test_what_is_written_and_what_is_told(repository: Path, golden: Golden, tmp_path: Path) -> None:
    found = import_files(LIFTER, "lifter", "srdf")
    golden.check("srdf_lifter.yaml", found.text)
    golden.check("srdf_lifter.txt", found.words)
    golden.check("srdf_lifter.collisions.yaml", found.beside["lifter.collisions.yaml"])
    compilation = compiled(tmp_path, found, LIFTER[1])
    assert [one.code for one in compilation.report if one.severity == "error"] == []
    assert compilation.robot is not None
    body = compilation.robot.manifest.body
    assert body is not None
    assert body.matrix is not None
    assert body.matrix.digest == digest_of(body.body, body.meshes)


@pytest.mark.parametrize("robot", ["lifter", "pi_robot"])
def test_what_is_exported_is_imported_as_the_same(robot: str, tmp_path: Path) -> None:
    if robot == "lifter":
        first = compiled(tmp_path / "one", import_files(LIFTER, "lifter", "srdf"), LIFTER[1])
    else:
        first = compile_robot(str(ROOT / "robots/pi_robot"), environment={})
    assert first.robot is not None
    for name, text in exported(first.robot.manifest.contents, robot).items():
        (tmp_path / name).write_text(text)
    paths = [tmp_path / f"{robot}.{end}" for end in ("srdf", "urdf")]
    again = import_files(paths, robot, "srdf")
    assert said(compiled(tmp_path / "two", again, paths[1])) == said(first)


def test_without_its_urdf_an_srdf_means_nothing() -> None:
    assert import_files(LIFTER[:1], "lifter", "srdf").told == [("RBX2231", 0)]


@pytest.mark.parametrize("name", ["panda", "ur5"])
def test_files_of_others_are_read(name: str) -> None:
    """Each is read as far as it goes, and nothing fails."""
    try:
        there = [Path(str(one.locate())) for one in files("example-robot-data") or []]
    except PackageNotFoundError:
        pytest.skip("example-robot-data is not installed")
    found = {one.name: one for one in there if one.suffix in (".srdf", ".urdf")}
    pair = [found[f"{name}.srdf"], found.get(f"{name}.urdf") or found[f"{name}_robot.urdf"]]
    made = import_files(pair, name, "srdf")
    assert made.text or made.report.has_errors
