"""Rules across components, for the values that they have while they run."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest

from rbxcompose.base.config import Bound, Config
from rbxcompose.commands.main import main as command
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.plan.diff import difference
from rbxcompose.compiler.plan.dump import dump, load
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.msgs.rcl_interfaces import Parameter
from rbxcompose.runtime.supervision.plan_change import Fate, changes
from rbxcompose.sdk.parameters import changed, to_message
from rbxcompose.testing import check_text
from rbxcompose.tools.live_rules import LiveRules
from tests.conftest import ROOT
from tests.forked import run_command
from tests.soak import rare

ROBOT = """rbx: 1
kind: Robot
name: one
args:
  speed: {type: speed, default: 0.3 m/s, min: 5 cm/s, max: 0.6 m/s}
components:
  base: {type: diff_drive_sim, max_speed: 0.5 m/s}
  go_to: {type: go_to, speed: "${args.speed}", turn_rate: "60 deg/s"}
"""
PART = """rbx: 1
kind: Part
name: legs
args:
  fast: {type: speed, default: 0.2 m/s, max: 0.55 m/s}
components:
  go_to: {type: go_to, speed: "${ args.fast }"}
"""


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    found = check_text(ROBOT, tmp_path).compilation.robot
    assert found is not None
    return found


def set_to(config: Config, name: str, value: object) -> Config:
    message = to_message(value)
    assert message is not None
    return changed(config, [Parameter(name=name, value=message)])


def test_a_value_that_breaks_a_rule_across_components_is_found(robot: Robot) -> None:
    go_to = robot.components["go_to"].config
    rules = LiveRules(robot)
    assert rules.why_not({}, {"go_to": set_to(go_to, "speed", "0.4 m/s")}) is None
    broken = rules.why_not({}, {"go_to": set_to(go_to, "speed", "0.55 m/s")})
    assert broken is not None
    assert (broken.breaks_rule, "RBX3503" in broken.reason, broken.help) == (
        *(True, True),
        "make 'speed' of 'go_to' at most 0.5 m/s",
    )


def test_navigation_keeps_the_room_that_the_robot_needs_also_while_it_runs(tmp_path: Path) -> None:
    text = (
        "rbx: 1\nkind: Robot\nname: one\nbody: {urdf: rbx:robots/turtlebot/turtlebot.urdf}\n"
        "world: rbx:worlds/house.yaml\nnavigation: {}\ncomponents:\n"
        "  base: {type: diff_drive_sim}\n  laser: {type: laser_sim, frame: base_link}\n"
    )
    robot = check_text(text, tmp_path).compilation.robot
    assert robot is not None
    rules, go_to = LiveRules(robot), robot.components["go_to"].config
    for name, value, code in (
        ("radius", "5 cm", "RBX3613"),
        ("inflation", "1 mm", "RBX3614"),
        ("sees", "10 cm", "RBX3642"),
        ("silence", "10 s", "RBX3642"),
        ("acceleration", "5 m/s^2", "RBX3503"),
    ):
        broken = rules.why_not({}, {"go_to": set_to(go_to, name, value)})
        assert broken is not None
        assert f"({code})" in broken.reason
    assert rules.why_not({}, {"go_to": set_to(go_to, "radius", "0.3 m")}) is None


def test_what_other_components_have_now_counts(robot: Robot) -> None:
    now = {"base": set_to(robot.components["base"].config, "max_speed", "0.9 m/s")}
    new = set_to(robot.components["go_to"].config, "speed", "0.55 m/s")
    assert LiveRules(robot).why_not(now, {"go_to": new}) is None


def test_what_was_broken_before_is_not_the_fault_of_a_change(robot: Robot) -> None:
    go_to = robot.components["go_to"].config
    now = {"go_to": set_to(go_to, "speed", "0.6 m/s")}
    assert LiveRules(robot).why_not(now, {"go_to": set_to(go_to, "speed", "0.55 m/s")}) is None


def test_the_limits_of_an_argument_are_in_the_plan_and_change_live(tmp_path: Path) -> None:
    plan = check_text(ROBOT, tmp_path).plan
    go_to = next(instance for instance in plan.instances if instance.name == "go_to")
    assert go_to.bounds == {"speed": (Bound(0.05, 0.6, "the argument 'speed' of the robot"),)}
    assert load(dump(plan)) == plan
    wider = check_text(ROBOT.replace("max: 0.6", "max: 0.7"), tmp_path).plan
    (change,) = difference(plan, wider).changed["go_to"]
    assert str(change) == "limits of speed: at least 0.05 m/s, at most 0.6 m/s -> at least 0.05 m/s, at most 0.7 m/s"
    assert changes(plan, wider).names(Fate.LIVE) == ["go_to"]


def test_the_argument_of_a_part_is_bounded_by_the_one_that_it_is_given(tmp_path: Path) -> None:
    head, _, _ = ROBOT.partition("  go_to:")
    text = head + "include:\n  legs: {part: legs.yaml, with: {fast: '${args.speed}'}}\n"
    plan = check_text(text, tmp_path, others={"legs.yaml": PART}).plan
    (instance,) = (candidate for candidate in plan.instances if candidate.type == "go_to")
    assert [bound.most for bound in instance.bounds["speed"]] == [0.55, 0.6]
    assert replace(instance.bounds["speed"][0], most=None).by == "the argument 'fast' of the part 'legs'"


MISSION = """rbx: 1
kind: Mission
name: hurry
do:
  - set_parameter: {component: go_to, parameter: speed, value: 0.4 m/s}
  - set_parameter: {component: go_to, parameter: speed, value: 0.55 m/s}
"""


def test_a_test_and_a_trial_of_a_mission_keep_them_as_well(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    text = ROBOT.replace("components:", "missions: {hurry: hurry.yaml}\ncomponents:", 1)
    (tmp_path / "robot.yaml").write_text(text)
    (tmp_path / "hurry.yaml").write_text(MISSION)
    test = "rbx: 1\nkind: Test\nname: hurried\nrobot: robot.yaml\nmission: hurry\nexpect: {outcome: failure}\n"
    (tmp_path / "hurried.test.yaml").write_text(test)
    assert command(["test", "hurried.test.yaml"]) == 0
    command(["mission", "try", "hurry", "robot.yaml"])
    assert (
        "failure: hurry.yaml:6: 'go_to' drives at 0.55 m/s, but its base 'base' can do 0.5" in capsys.readouterr().out
    )


@pytest.mark.parametrize("pace", [(), *rare(("--rate", "max"))])
def test_what_a_mission_sets_keeps_the_rules_of_the_robot(tmp_path: Path, pace: tuple[str, ...]) -> None:
    text = ROBOT.replace(
        "components:", "bus: {port: 7921}\nmissions: {hurry: hurry.yaml}\nstart: hurry\ncomponents:", 1
    )
    (tmp_path / "robot.yaml").write_text(text)
    (tmp_path / "hurry.yaml").write_text(MISSION)
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path), "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
    done = run_command(("up", str(tmp_path), *pace), environment, 30.0)
    assert "set: speed = 0.4 m/s, by mission hurry" in done.stdout, done.stdout + done.stderr
    assert "'base' can do 0.5 m/s at most (RBX3503)" in done.stdout, done.stdout
    assert "set: speed = 0.55 m/s" not in done.stdout


def test_a_value_by_which_the_base_would_stop_too_late_after_a_cut_link_is_refused() -> None:
    system = compile_system(str(ROOT / "systems/patrol_two_hosts.yaml"), environment={})
    (placed,) = system.robots.values()
    base, rules = placed.robot.components["base"].config, LiveRules(placed.robot, (system, placed))
    assert rules.why_not({}, {"base": set_to(base, "command_timeout", "0.2 s")}) is None
    refusal = rules.why_not({}, {"base": set_to(base, "command_timeout", "3 s")})
    assert refusal is not None
    assert refusal.reason.startswith("after a link is cut, 'base' on robot stands still within")
    assert refusal.reason.endswith("(RBX6140)")
    assert (
        LiveRules(placed.robot).why_not({}, {"base": set_to(base, "command_timeout", "3 s")}) is None
    )  # nobody's link
