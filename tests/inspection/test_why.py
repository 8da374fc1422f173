"""`why`: where a value comes from, in the words that a person needs."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from rbxcompose.base.findings import Finding
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.testing import Golden, check_text
from rbxcompose.tools.inspection.origin import leaves
from rbxcompose.tools.inspection.why import PathAnswer, short, why
from tests.loops import for_all

ASKED = {
    "turtlebot": (
        "battery.runtime",
        "base.max_speed",
        "go_to.speed",
        "base.acceleration",
        "base",
        "bus.domain",
        "bus",
        "args.speed",
        "args.speed.default",
        "diagnostics.analyzers.power.match",
        "diagnostics.analyzers.power.match.1",
        "missions.patrol.with.low",
        "go_to.cmd_vel",
        "go_to.go_to",
        "go_to.pose",
        "cmd_vel.teleop",
        "transforms",
        "start",
    ),
    "twins": (
        "nav_go_to.speed",
        "nav_go_to.tolerance",
        "lift_battery.warn",
        "drive_battery.battery_level",
        "include.nav",
    ),
}


@pytest.fixture(autouse=True)
def _at_home(repository: Path) -> None:
    """Answers name files as from the repository's root."""


@cache
def robot(name: str) -> Robot:
    sets = ("base.max_speed=0.4 m/s", "start=!remove") if name == "turtlebot" else ()
    found = compile_robot(f"robots/{name}", profiles=("tired",), sets=sets, environment={}).robot
    assert found
    return found


def ask(path: str, name: str = "turtlebot") -> PathAnswer:
    answer = why(robot(name), path)
    assert isinstance(answer, PathAnswer), answer
    return answer


@pytest.mark.parametrize("name", ASKED)
def test_an_answer_tells_value_unit_place_meaning_and_what_it_took_the_place_of(name: str, golden: Golden) -> None:
    golden.check(f"why_{name}.txt", "\n\n".join(ask(path, name).text() for path in ASKED[name]) + "\n")


@pytest.mark.parametrize("name", ASKED)
def test_every_value_that_is_written_can_be_asked_for(name: str) -> None:
    for path, _ in leaves(robot(name).manifest.root):
        answer = ask(short(path), name)
        assert answer.layers[-1].value is not None
        assert not answer.is_default


def test_the_layers_stand_in_order_and_the_last_one_holds() -> None:
    assert [(layer.name, layer.value) for layer in ask("battery.runtime").layers] == [
        ("the robot", "45 s"),
        ("profile 'tired'", "30 s"),
    ]
    assert [(layer.name, layer.value) for layer in ask("start").layers] == [("the robot", "patrol"), ("--set", None)]


def test_an_angle_is_told_in_si() -> None:
    answer = ask("base.max_turn_rate").data()
    assert (answer["value"], answer["unit"]) == ("90 deg/s", "rad/s")
    assert answer["si"] == pytest.approx(1.5708, abs=1e-4)


def test_a_default_says_so_and_where_it_can_be_set() -> None:
    answer = ask("base.acceleration")
    assert (answer.value, answer.is_default, answer.layers) == ("1 m/s^2", True, ())
    assert "--set base.acceleration=VALUE" in answer.text()


@for_all(
    "path, message, help_text",
    [
        ("batery.runtime", "robot 'turtlebot' has no 'batery'", "did you mean 'battery'?"),
        ("battery.runtme", "'battery' has no 'runtme'", "did you mean 'runtime'?"),
        ("speed", "robot 'turtlebot' has no 'speed'", "did you mean 'args.speed'?"),
        ("dock.x", "robot 'turtlebot' has no 'dock'", "did you mean 'places.dock.x'?"),
        ("go_to.cmd_ve", "'go_to' has no 'cmd_ve'", "did you mean 'cmd_vel'?"),
        ("muxes.cmd_vel.inputs.telop.priority", "'muxes.cmd_vel.inputs' has no 'telop'", "did you mean 'teleop'?"),
        ("battery.runtime.x", "'battery.runtime' has no 'x'", ""),
        ("bus.domian", "'bus' has no 'domian'", "did you mean 'domain'?"),
        ("transforms.x", "robot 'turtlebot' has no", ""),
        ("diagnostics.analyzers.power.match.7", "'diagnostics.analyzers.power.match' has no '7'", "what it has: 0, 1"),
        ("", "robot 'turtlebot' has no ''", ""),
        ("...", "robot 'turtlebot' has no ''", ""),
        ("profiles.tired", "profiles have no value of their own", "'--profile NAME' applies one"),
        ("places.\x1b[31m", "'places' has no", ""),
    ],
)
def test_a_path_that_leads_nowhere_is_a_finding_with_what_was_meant(path: str, message: str, help_text: str) -> None:
    finding = why(robot("turtlebot"), path)
    assert isinstance(finding, Finding)
    assert finding.code == "RBX9011"
    assert finding.message.startswith(message)
    assert help_text in finding.help
    assert "\x1b" not in finding.message


def test_a_namespace_is_named_as_the_reason_of_a_topic(tmp_path: Path) -> None:
    text = "rbx: 1\nkind: Robot\nname: one\nbus:\n  namespace: left\ncomponents:\n  base:\n    type: diff_drive_sim\n"
    found = check_text(text, tmp_path).compilation.robot
    assert found
    answer = why(found, "base.odom")
    assert isinstance(answer, PathAnswer)
    assert "at /left/odom, as state" in answer.value
    assert "in the namespace 'left'" in answer.text()


def test_what_a_section_runs_stands_where_the_section_does(tmp_path: Path) -> None:
    text = "rbx: 1\nkind: Robot\nname: one\nbody:\n  urdf: one.urdf\n"
    made = check_text(text, tmp_path, others={"one.urdf": '<robot><link name="base"/></robot>'}).compilation.robot
    assert made is not None
    told = why(made, "robot_description")
    assert isinstance(told, PathAnswer)
    assert told.hints == (("where", f"{tmp_path}/robot.yaml:5:3"),)


def test_a_robot_with_mistakes_can_be_asked_too(tmp_path: Path) -> None:
    text = "rbx: 1\nkind: Robot\nname: one\ncomponents:\n  base:\n    type: diff_drive_sim\n    max_speed: fast\n"
    found = check_text(text, tmp_path).compilation.robot
    assert found
    answer = why(found, "base.max_speed")
    assert isinstance(answer, PathAnswer)
    assert (answer.value, answer.si) == ("fast", None)


ARGUMENTS = """\
rbx: 1
kind: Robot
name: one
args:
  speed: {type: speed, default: 0.3 m/s, min: 5 cm/s, max: 0.5 m/s, about: Between places.}
  room: {type: choice, choices: [kitchen, hall]}
profiles:
  slow: {args: {speed: 0.1 m/s}}
"""
OVERLAY = "rbx: 1\nkind: Overlay\nname: over\nargs: {speed: 0.2 m/s}\n"


def test_an_argument_is_its_value_in_effect_with_the_layers_below(tmp_path: Path) -> None:
    (tmp_path / "over.yaml").write_text(OVERLAY, encoding="utf-8")
    sets = ["args.speed=0.4 m/s"]
    checked = check_text(ARGUMENTS, tmp_path, profiles=["slow"], overlays=[str(tmp_path / "over.yaml")], sets=sets)
    found = checked.compilation.robot
    assert found
    answer = why(found, "args.speed")
    assert isinstance(answer, PathAnswer)
    assert (answer.path, answer.value, answer.about, answer.si) == ("args.speed", "0.4 m/s", "Between places.", 0.4)
    assert [layer.value for layer in answer.layers] == ["0.3 m/s", "0.1 m/s", "0.2 m/s", "0.4 m/s"]
    assert [layer.name for layer in answer.layers][0::3] == ["the robot", "--set"]
    assert dict(answer.hints)["type"] == "speed, at least 5 cm/s, at most 0.5 m/s"


def test_an_argument_without_a_value_says_how_to_give_one(tmp_path: Path) -> None:
    found = check_text(ARGUMENTS, tmp_path).compilation.robot
    assert found
    answer = why(found, "args.room")
    assert isinstance(answer, PathAnswer)
    assert answer.value == "nothing"
    assert dict(answer.hints) == {"type": "choice, one of [kitchen, hall]", "to set it": "--set args.room=VALUE"}


def test_an_argument_that_a_value_is_filled_in_from_shows_what_it_took_the_place_of(tmp_path: Path) -> None:
    text = ARGUMENTS + "components:\n  go_to: {type: go_to, speed: '${args.speed}'}\n  base: {type: diff_drive_sim}\n"
    (tmp_path / "over.yaml").write_text(OVERLAY, encoding="utf-8")
    over = [str(tmp_path / "over.yaml")]
    found = check_text(text, tmp_path, profiles=["slow"], overlays=over, sets=["args.speed=0.4 m/s"]).compilation.robot
    assert found
    answer = why(found, "go_to.speed")
    assert isinstance(answer, PathAnswer)
    [source] = answer.sources
    assert (source.value, [layer.value for layer in source.below]) == ("0.4 m/s", ["0.3 m/s", "0.1 m/s", "0.2 m/s"])
    shown = [line.strip() for line in answer.text().replace(str(tmp_path), "").splitlines()[-4:]]
    assert shown == [
        "from           args.speed = 0.4 m/s  --set",
        "instead of 0.2 m/s  /over.yaml:4, overlay",
        "instead of 0.1 m/s  /robot.yaml:8, profile 'slow'",
        "instead of 0.3 m/s  /robot.yaml:5",
    ]
    assert answer.data()["filled_in_from"][0]["below"][0]["line"] == 5
