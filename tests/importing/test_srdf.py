"""An SRDF becomes arms and a file of pairs; what is exported of them is imported as the same."""

from __future__ import annotations

import math
import shutil
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

import pytest
import yaml

from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.domains.body.link_pairs import digest_of
from rbxcompose.domains.body.srdf import EndEffector, SemanticGroup, Semantics
from rbxcompose.testing.golden import Golden
from rbxcompose.tools.exporting.srdf import exported, semantics_of
from tests import shipped
from tests.body.described import described
from tests.conftest import ROOT
from tests.importing.imports import EXAMPLES, Imported, import_files
from tests.loops import for_all

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
    assert [finding.code for finding in compilation.report if finding.severity == "error"] == []
    assert compilation.robot is not None
    body = described(compilation.robot.manifest)
    assert body.matrix is not None
    assert body.matrix.digest == digest_of(body.body, body.meshes)


@pytest.mark.parametrize("robot", ["lifter", "pi_robot"])
def test_what_is_exported_is_imported_as_the_same(robot: str, tmp_path: Path) -> None:
    if robot == "lifter":
        first = compiled(tmp_path / "one", import_files(LIFTER, "lifter", "srdf"), LIFTER[1])
    else:
        first = shipped.compiled(str(ROOT / "robots/pi_robot"), environment={})
    assert first.robot is not None
    for name, text in exported(first.robot.manifest.contents, robot).items():
        (tmp_path / name).write_text(text)
    paths = [tmp_path / f"{robot}.{end}" for end in ("srdf", "urdf")]
    again = import_files(paths, robot, "srdf")
    assert said(compiled(tmp_path / "two", again, paths[1])) == said(first)


def test_what_is_left_out_is_reported_where_it_is_written(tmp_path: Path) -> None:
    added = """
    <group name="Arm"><joint name="lift"/></group>
    <group_state name="low" group="Arn"><joint name="lift" value="0"/></group_state>
    <group_state name="Low" group="torso"><joint name="lift" value="0"/><joint name="grasp" value="0"/></group_state>
    <passive_joint name="grasp"/>
</robot>"""
    (tmp_path / "lifter.srdf").write_text(LIFTER[0].read_text().replace("\n</robot>", added))
    before = import_files(LIFTER, "lifter", "srdf")
    after = import_files([tmp_path / "lifter.srdf", LIFTER[1]], "lifter", "srdf")
    line = LIFTER[0].read_text().count("\n")
    new = [("RBX2230", line), ("RBX2311", line + 1), *((code, line + 2) for code in ("RBX2230", "RBX2313"))]
    new += [("RBX2230", line + 3)]
    assert [each for each in after.told if each not in before.told] == new
    assert after.data["arms"]["arm"] == before.data["arms"]["arm"]
    for words in ("a further group 'Arm' has", "did you mean 'Arm'?", "'Low' is called 'low'", "joint 'grasp' has no"):
        assert words in after.words
    assert "in the pose 'Low' of 'torso': 'grasp', not moved by it" in after.words


def test_limits_of_the_robot_are_exported_beside_those_of_its_urdf(tmp_path: Path) -> None:
    made = import_files(LIFTER, "lifter", "srdf")
    limits = "limits: {position: [-1 rad, 0.5 rad], velocity: 0.2 rad/s, acceleration: 3 rad/s^2}"
    text = made.text.replace("elbow: {actuator: elbow_servo", f"elbow: {{actuator: elbow_servo, {limits}")
    robot = compiled(tmp_path, replace(made, text=text), LIFTER[1]).robot
    assert robot is not None
    found = yaml.safe_load(exported(robot.manifest.contents, "lifter")["joint_limits.yaml"])["joint_limits"]
    assert list(found) == ["shoulder", "elbow", "lift", "grasp"]
    position = {"has_position_limits": True, "min_position": -1.0, "max_position": 0.5}
    velocity = {"has_velocity_limits": True, "max_velocity": 0.2}
    assert found["elbow"] == {**position, **velocity, "has_acceleration_limits": True, "max_acceleration": 3.0}
    assert found["shoulder"]["min_position"] == -2.0


@for_all("tip, links", [("palm", ("finger", "thumb")), ("fore", ("palm", "finger", "thumb"))])
def test_a_gripper_is_exported_with_its_links_on_a_link_of_its_arm(
    tip: str, links: tuple[str, ...], tmp_path: Path
) -> None:
    said_first = LIFTER[0].read_text().replace('tip_link="palm"', f'tip_link="{tip}"')
    (tmp_path / "lifter.srdf").write_text(said_first.replace('parent_link="palm"', f'parent_link="{tip}"'))
    made = import_files([tmp_path / "lifter.srdf", LIFTER[1]], "lifter", "srdf")
    found = said(compiled(tmp_path / "made", made, LIFTER[1]))
    assert found.effectors == (EndEffector("hand", "hand", tip, "arm"),)
    assert found.groups["hand"] == SemanticGroup("hand", joints=("grasp",), links=links)


FITS = '<virtual_joint name="world_joint" type="fixed" parent_frame="world" child_link="base"/>'


@for_all(
    "written, words, taken",
    [
        (FITS.replace("fixed", "Planar").replace("world", "odom"), [], ("odom_joint", "planar", "odom")),
        (FITS.replace("fixed", "hinge"), ["no type 'hinge'", "fixed, planar or floating"], "world"),
        (FITS.replace('frame="world', 'frame="/world'), ["frame '/world' is called 'world'"], "world"),
        (FITS.replace('"base"', '"palm"'), ["the root of the URDF is 'base'", 'write child_link="base"'], None),
        (FITS.replace('"base"', '"nobody"'), ["the root of the URDF is 'base'"], None),
        (FITS.replace('"world"', '"palm"'), ["'palm' is a link of the URDF", "leave it out"], None),
        (FITS.replace('"world_joint"', '"wrist"'), ["the URDF has a joint of its name"], None),
        (FITS.replace(' parent_frame="world"', ""), ["it has no 'parent_frame'"], None),
        (FITS.replace('"world"', '"the world"'), ["there are spaces in its names"], None),
        (FITS + FITS.replace("world", "map"), ["'world_joint' places the root of the URDF already"], "world"),
        (FITS.replace('"base"', '"palm"') + FITS, ["the root of the URDF is 'base'"], "world"),
    ],
)
def test_the_virtual_joint_is_the_one_that_moveit_takes(
    written: str, words: list[str], taken: str | tuple[str, str, str] | None, tmp_path: Path
) -> None:
    said = LIFTER[0].read_text().replace(FITS, written)
    (tmp_path / "lifter.srdf").write_text(said)
    found = import_files([tmp_path / "lifter.srdf", LIFTER[1]], "lifter", "srdf")
    line = 1 + said[: said.index("<virtual_joint")].count("\n")
    assert found.told.count(("RBX2353", line)) == bool(words)
    assert [word for word in words if word not in found.words] == []
    name, kind, frame = taken if isinstance(taken, tuple) else ("world_joint", "fixed", taken)
    wanted = {"name": name, "type": kind, "frame": frame} if frame is not None else None
    assert found.data["body"].get("virtual_joint") == wanted


def test_what_the_urdf_does_not_have_is_not_exported(tmp_path: Path) -> None:
    made = import_files(LIFTER, "lifter", "srdf")
    text = made.text.replace("{from: column, to: palm}", "{from: world, to: palm}")
    assert text != made.text
    robot = compiled(tmp_path, replace(made, text=text), LIFTER[1]).robot
    assert robot is not None
    files = exported(robot.manifest.contents, "lifter")
    assert files["lifter.urdf"] == LIFTER[1].read_text()
    assert semantics_of(robot.manifest.contents, "").groups["arm"].chains == (("base", "palm"),)
    assert FITS in files["lifter.srdf"]


def test_a_joint_that_turns_without_end_gets_the_range_of_a_servo_as_a_guess(tmp_path: Path) -> None:
    paths = [tmp_path / f"lifter.{end}" for end in ("srdf", "urdf")]
    paths[0].write_text(LIFTER[0].read_text().replace('name="shoulder" value="-0.5"', 'name="shoulder" value="4.0"'))
    paths[1].write_text(
        LIFTER[1].read_text().replace('name="shoulder" type="revolute"', 'name="shoulder" type="continuous"')
    )
    made = import_files(paths, "lifter", "srdf")
    assert made.data["arms"]["arm"]["poses"]["home"]["shoulder"] == f"{4.0 - math.tau!r} rad"
    [line] = [line for line in made.text.splitlines() if "shoulder_servo, limits" in line]
    assert "[-179.0 deg, 179.0 deg]" in line
    assert line.endswith("# a guess")
    report = compiled(tmp_path / "made", made, paths[1]).report
    assert [finding.code for finding in report if finding.severity == "error"] == []


def test_without_its_urdf_an_srdf_means_nothing() -> None:
    assert import_files(LIFTER[:1], "lifter", "srdf").told == [("RBX2231", 0)]


@pytest.mark.parametrize("name", ["panda", "ur5"])
def test_files_of_others_are_read(name: str) -> None:
    """Each is read as far as it goes, and nothing fails."""
    try:
        there = [Path(str(file.locate())) for file in files("example-robot-data") or []]
    except PackageNotFoundError:
        pytest.skip("example-robot-data is not installed")
    found = {path.name: path for path in there if path.suffix in (".srdf", ".urdf")}
    pair = [found[f"{name}.srdf"], found.get(f"{name}.urdf") or found[f"{name}_robot.urdf"]]
    made = import_files(pair, name, "srdf")
    assert made.text or made.report.has_errors
