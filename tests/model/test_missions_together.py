"""Missions of one robot: which use which, and what they get of the robot."""

from __future__ import annotations

from pathlib import Path

from rbxcompose.compiler.compile import Compilation, compile_robot

ROBOT = """
rbx: 1
kind: Robot
name: bot
places:
  dock: {x: 0 m, y: 0 m, heading: 0 deg}
components:
  battery: {type: battery_sim, runtime: 45 s}
  base: {type: diff_drive_sim, max_speed: 0.5 m/s, max_turn_rate: 90 deg/s, command_timeout: 0.5 s}
  go_to: {type: go_to, speed: 0.3 m/s}
diagnostics:
  analyzers:
    power: {match: [battery]}
values:
  power: diagnostics.power
missions:
"""
HEAD = "rbx: 1\nkind: Mission\nname: {name}\n"


def compiled(folder: Path, **missions: str) -> Compilation:
    (folder / "robots").mkdir()
    entries = ""
    for name, text in missions.items():
        (folder / f"{name}.yaml").write_text(HEAD.format(name=name) + text, encoding="utf-8")
        entries += f"  {name}: ../{name}.yaml\n"
    file = folder / "robots" / "bot.yaml"
    file.write_text(ROBOT + entries, encoding="utf-8")
    return compile_robot(str(file), environment={})


def told(out: Compilation, code: str) -> list[str]:
    return [finding.message for finding in out.report if finding.code == code]


def test_missions_can_use_each_other_whatever_their_order(tmp_path: Path) -> None:
    out = compiled(tmp_path, outer="do:\n  use: inner\n", inner="do:\n  go_to: dock\n")
    assert not out.report.has_errors, list(out.report)
    assert out.plan is not None


def test_a_circle_is_told_once_with_each_of_its_steps(tmp_path: Path) -> None:
    out = compiled(
        tmp_path,
        a="do:\n  - wait: 1 s\n  - use: b\n",
        b="do:\n  use: c\n",
        c="do:\n  - use: a\n  - wait: 1 s\n",
        d="do:\n  use: a\n",
    )
    assert told(out, "RBX4146") == ["missions use each other in a circle: a -> b -> c -> a"]
    [finding] = [candidate for candidate in out.report if candidate.code == "RBX4146"]
    assert [one.message for one in finding.related] == ["'b' uses 'c'", "'c' uses 'a'"]
    assert [one.code for one in out.report if one.severity.name == "ERROR"] == ["RBX4146"]


def test_a_mission_that_uses_itself_is_a_circle(tmp_path: Path) -> None:
    assert told(compiled(tmp_path, a="do:\n  use: a\n"), "RBX4146") == ["missions use each other in a circle: a -> a"]


def test_missions_that_grow_without_measure_are_told(tmp_path: Path) -> None:
    lists = {f"m{number}": "do:\n" + f"  - use: m{number + 1}\n" * 9 for number in range(5)}
    out = compiled(tmp_path, **lists, m5="do:\n  - wait: 1 s\n")
    assert told(out, "RBX4147") == ["mission 'm1' has 21,322 nodes with all that it uses; 20,000 are allowed"]


def test_the_level_of_a_group_of_the_diagnostics_is_a_value(tmp_path: Path) -> None:
    fine = compiled(tmp_path, a="do:\n  wait_for: $power == ok\n")
    assert fine.robot is not None
    assert not fine.report.has_errors, list(fine.report)
    assert fine.robot.values["power"].type.choices == ("ok", "warn", "error", "stale")


def test_a_level_that_there_is_not_is_told(tmp_path: Path) -> None:
    out = compiled(tmp_path, a="do:\n  wait_for: $power == fine\n")
    assert out.report.has_errors


def test_topics_and_services_of_the_robot_can_be_used(tmp_path: Path) -> None:
    text = "do:\n  - publish: /diagnostics\n  - call: set_battery_level\n"
    out = compiled(tmp_path, a=text)
    assert out.plan is not None, list(out.report)
    ports = {wire.port for instance in out.plan.instances if instance.name == "mission" for wire in instance.wires}
    assert {"publishes_diagnostics", "calls_set_battery_level"} <= ports


def test_a_mission_that_commands_the_base_beside_a_component_is_told_like_any_other_writer(tmp_path: Path) -> None:
    out = compiled(tmp_path, a="do:\n  publish: cmd_vel\n")
    assert told(out, "RBX3001") == ["this mission and 'go_to' both write commands on '/cmd_vel'"]


def test_a_skill_in_python_is_there_for_who_names_it(tmp_path: Path) -> None:
    out = compiled(tmp_path, a="do:\n  say: hello there\n")
    assert out.robot is not None
    assert "say" in out.robot.skills


GO = "inputs: {where: {type: place}}\ndo: {go_to: $where}\n"


def test_an_input_may_be_left_to_who_uses_or_begins_the_mission(tmp_path: Path) -> None:
    out = compiled(tmp_path, go=GO, both="do: [{use: go, with: {where: dock}}]\n")
    assert not out.report.has_errors, list(out.report)


def test_each_use_needs_the_inputs_that_have_no_default(tmp_path: Path) -> None:
    out = compiled(tmp_path, go=GO, both="do: {use: go}\n")
    assert told(out, "RBX4113") == ["the input 'where' of the mission 'go' needs a value"]


def test_so_does_the_mission_that_begins_by_itself(tmp_path: Path) -> None:
    compiled(tmp_path, go=GO)
    out = compile_robot(str(tmp_path / "robots/bot.yaml"), sets=["start=go"], environment={})
    assert told(out, "RBX4113") == ["the input 'where' of the mission 'go' needs a value"]
