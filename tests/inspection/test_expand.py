"""`expand`: the composed robot is a manifest of the same robot, and tells where each value is from."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbxcompose.base.printable import FORBIDDEN
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.plan.diff import difference
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.testing import Checked, Golden, check_file, check_text
from rbxcompose.tools.inspection.origin import expand, expand_data, leaves
from tests.conftest import ROOT

TURTLEBOT, TWINS = "robots/turtlebot/robot.yaml", "robots/twins/robot.yaml"
SETS = (
    "base.max_speed=0.37 m/s",
    "args.speed=0.1 m/s",
    "missions.patrol.with.rounds=3",
    "start=!remove",
    "bus.port=7999",
)


def robot_of(checked: Checked) -> Robot:
    assert checked.compilation.robot, checked.text
    return checked.compilation.robot


def again(text: str, folder: Path) -> Checked:
    """Compile a robot's text beside copies of the missions that ship with the package."""
    missions = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "missions").glob("*.yaml")}
    robot = folder / "robots/one"
    return check_text(text, robot, others={f"../../missions/{name}": mission for name, mission in missions.items()})


def test_each_value_has_its_origin_behind_it(repository: Path, golden: Golden) -> None:
    overlay = ["base.max_speed=0.4 m/s"]
    golden.check(
        "turtlebot.txt", expand(robot_of(check_file(Path(TURTLEBOT), profiles=["tired"], sets=overlay)).manifest)
    )
    golden.check("twins.txt", expand(robot_of(check_file(Path(TWINS), profiles=["tired"])).manifest))


def without_arguments(plan: Plan) -> Plan:
    """Return a plan without the limits of arguments, which are filled in."""
    return replace(plan, instances=tuple(replace(instance, bounds={}) for instance in plan.instances))


SELDOM = [pytest.param(*one, marks=pytest.mark.soak) for one in (((), True), (("tired",), False))]


@pytest.mark.parametrize("file", [TURTLEBOT, TWINS])
@pytest.mark.parametrize(("profiles", "has_origins"), [(("tired",), True), ((), False), *SELDOM])
def test_what_it_writes_is_the_same_robot(
    file: str, profiles: tuple[str, ...], has_origins: bool, repository: Path, tmp_path: Path
) -> None:
    first = check_file(Path(file), profiles=profiles)
    text = expand(robot_of(first).manifest, has_origins=has_origins)
    second = again(text, tmp_path)
    assert second.codes == [], second.text
    assert difference(without_arguments(first.plan), second.plan).is_empty
    assert [instance.name for instance in first.plan.instances] == [instance.name for instance in second.plan.instances]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(sets=st.lists(st.sampled_from(SETS), max_size=4), profiles=st.sampled_from([(), ("tired",)]))
def test_to_expand_what_was_expanded_changes_nothing(
    sets: list[str], profiles: tuple[str, ...], repository: Path, tmp_path: Path
) -> None:
    sets = list({set_.partition("=")[0]: set_ for set_ in sets}.values())
    first = robot_of(check_file(Path(TURTLEBOT), profiles=profiles, sets=sets)).manifest
    text = expand(first, has_origins=False)
    assert expand(robot_of(again(text, tmp_path)).manifest, has_origins=False) == text


def test_a_secret_is_written_by_its_name_and_never_shown(tmp_path: Path) -> None:
    checked = check_text(
        "rbx: 1\nkind: Robot\nname: one\ncomponents:\n  battery:\n    type: battery_sim\n    runtime: ${secret.key}\n",
        tmp_path,
        environment={"RBX_SECRET_KEY": "correct horse"},
    )
    manifest = robot_of(checked).manifest
    assert "runtime: ${secret.key}" in expand(manifest)
    told = json.dumps(expand_data(manifest))
    assert '"***"' in told
    assert "correct horse" not in told + expand(manifest)


def test_a_robot_with_mistakes_is_written_as_far_as_it_could_be_read(tmp_path: Path) -> None:
    checked = check_text('rbx: 1\nkind: Robot\nname: one\nplaces:\n  dock: {x: "${args.no}", y: soon}\n', tmp_path)
    text = expand(robot_of(checked).manifest, has_origins=False)
    assert "    y: soon\n" in text
    assert again(text, tmp_path).codes == checked.codes


def test_text_of_the_environment_cannot_reorder_what_is_shown(repository: Path) -> None:
    path = str(repository / "robots/turtlebot")
    compilation = compile_robot(path, sets=["about=${env.WORDS}"], environment={"WORDS": "a\u202eb\x1b[2J"})
    assert compilation.robot is not None
    text = expand(compilation.robot.manifest)
    assert 'about: "a\\u202eb\\u001b[2J"' in text
    assert not FORBIDDEN.search(text)


def test_as_data_every_value_has_its_origin(repository: Path) -> None:
    manifest = robot_of(check_file(Path(TWINS))).manifest
    data = json.loads(json.dumps(expand_data(manifest)))
    assert set(data["origins"]) == {".".join(map(str, path)) for path, _ in leaves(manifest.root)}
    assert data["robot"]["components"]["nav_go_to"]["speed"] == "0.4 m/s"
    assert data["origins"]["components.nav_go_to.speed"] == {
        "file": "parts/navigation.yaml",
        "line": 32,
        "column": 12,
        "layer": "part 'nav'",
        "written": "${args.speed}",
    }
