"""The topic on which a person drives: an open input of the mux, whatever it is called, and nothing behind a mux."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.bus.graph import GraphEnd, GraphName, WireType
from rbxcompose.commands.console import NotDoneError
from rbxcompose.compiler.plan.teleoperation import teleoperated
from rbxcompose.domains.bases.commands.drive import command_topic
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.testing import check_text

ROBOT = """rbx: 1
kind: Robot
name: one
components:
  base: {type: diff_drive_sim}
  go_to: {type: go_to}
muxes:
  cmd_vel:
    inputs:
      pad: {priority: 20, timeout: 0.5 s}
      joystick: {priority: 90, timeout: 0.5 s}
      navigation: {from: go_to, priority: 100, timeout: 0.5 s}
"""


def topic(name: str, givers: str = "", takers: str = "") -> GraphName:
    def ends(nodes: str) -> tuple[GraphEnd, ...]:
        return tuple(GraphEnd(node, WireType(Twist.TYPE, "h"), b"", None) for node in nodes.split())

    return GraphName(name, ends(givers), ends(takers))


MUXED = [
    topic("/cmd_vel", "/cmd_vel", "/base"),
    topic("/cmd_vel/joystick", "", "/cmd_vel"),
    topic("/cmd_vel/navigation", "/go_to", "/cmd_vel"),
]


def test_of_a_mux_it_is_the_open_input_of_the_highest_priority(tmp_path: Path) -> None:
    assert teleoperated(check_text(ROBOT, tmp_path).plan) == {"base": "/cmd_vel/joystick"}


def test_of_a_mux_with_an_input_for_people_it_is_that_one(tmp_path: Path) -> None:
    own = ROBOT.replace("pad:", "teleop:")
    assert teleoperated(check_text(own, tmp_path).plan) == {"base": "/cmd_vel/teleop"}


def test_without_a_mux_it_is_the_base_unless_something_commands_it(tmp_path: Path) -> None:
    alone, _, _ = ROBOT.partition("  go_to:")
    assert teleoperated(check_text(alone, tmp_path).plan) == {"base": "/cmd_vel"}
    driven, _, _ = ROBOT.partition("muxes:")
    assert teleoperated(check_text(driven, tmp_path).plan) == {}


def test_what_the_robot_declares_is_taken() -> None:
    pad = topic("/cmd_vel/pad", "", "/cmd_vel")
    assert command_topic([*MUXED, pad], None, {"base": "/cmd_vel/joystick"}) == "/cmd_vel/joystick"


def test_on_a_foreign_bus_what_a_mux_forwards_to_is_never_taken() -> None:
    assert command_topic(MUXED, None, None) == "/cmd_vel/joystick"


@pytest.mark.parametrize("inputs", [None, {}])
def test_if_no_input_is_open_none_is_proposed(inputs: dict[str, str] | None) -> None:
    with pytest.raises(NotDoneError) as error:
        command_topic([MUXED[0], MUXED[2]], None, inputs)
    assert "did you mean" not in str(error.value.finding)
    assert "without 'from'" in (error.value.finding.help or "")


def test_a_misspelt_topic_is_never_corrected_to_one_behind_a_mux() -> None:
    with pytest.raises(NotDoneError) as error:
        command_topic(MUXED, "cmd_velo", {"base": "/cmd_vel/joystick"})
    assert "'/cmd_vel'" not in f"{error.value.finding}"


def test_several_bases_are_told_apart() -> None:
    two = [topic("/left/cmd_vel", "", "/left"), topic("/right/cmd_vel", "", "/right")]
    with pytest.raises(NotDoneError, match=r"/left/cmd_vel \('a'\), /right/cmd_vel \('b'\)"):
        command_topic(two, None, {"a": "/left/cmd_vel", "b": "/right/cmd_vel"})
