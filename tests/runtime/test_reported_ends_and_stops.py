"""What people are told: how a process ended, and who has stopped the robot."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rbxcompose.base.levels import Level
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.process_group.connection import MARK
from rbxcompose.runtime.supervision.supervisor import with_reason
from rbxcompose.sdk.component import RobotHeld
from tests.runtime.stage import Stage

TRACEBACK = 'Traceback (most recent call last):\n  File "lidar.py", line 3, in step\n'


def test_the_log_tells_that_a_process_hung_and_not_only_by_which_signal_it_was_ended() -> None:
    stage = Stage().start()
    stage.beats.discard("robot")
    stage.pass_time(2.5)
    stage.exit("robot")
    assert stage.records[-1] == (Level.ERROR, "process 'robot' was silent for 2 s and was killed; restarting it")
    stage.pass_time(1.0)
    stage.exit("robot")
    assert stage.records[-1][1] == "process 'robot' was killed by SIGKILL; restarting it"


def test_a_process_that_ended_itself_before_it_could_be_killed_is_told_as_it_ended() -> None:
    stage = Stage().start()
    stage.beats.discard("robot")
    stage.pass_time(2.5)
    stage.exit("robot", "hung and ended itself")
    assert stage.records[-1][1] == "process 'robot' hung and ended itself; restarting it"


@pytest.mark.parametrize(
    ("how", "printed", "told"),
    [
        ("ended with status 1", "a line\n", "ended with status 1"),
        ("ended with status 1", f"{TRACEBACK}KeyboardInterrupt\n", "ended with status 1: KeyboardInterrupt"),
        ("was killed by SIGKILL", f"{TRACEBACK}KeyError: 3\n", "was killed by SIGKILL"),
        ("ended with status 1", f"{MARK}2 s\n{TRACEBACK}", "hung for 2 s and ended itself"),
    ],
)
def test_the_end_of_a_process_is_told_with_the_reason_that_it_printed(how: str, printed: str, told: str) -> None:
    assert with_reason(how, printed) == told


def test_who_has_stopped_the_robot_is_known_until_it_is_released() -> None:
    stage = Stage().start()
    stage.speak("robot", RobotHeld("go_to", "a child is near"))
    writes = stage.writes
    stage.conductor.stop("a person")
    state = stage.conductor.latch.state
    assert state is not None
    assert (state.by, state.holds) == ("'go_to': a child is near", {"go_to": "a child is near"})
    stage.speak("robot", RobotHeld("go_to", ""))
    assert replace(state, holds={}) == stage.conductor.latch.state
    stage.conductor.release()
    assert stage.writes == writes + 3
    assert stage.conductor.latch.state is None


def test_a_component_that_failed_on_the_path_of_commands_is_who_has_stopped_it() -> None:
    stage = Stage().start()
    stage.speak("robot", say.States({"mux": ("failed", 5)}))
    state = stage.conductor.latch.state
    assert state is not None
    assert state.by == "'mux' failed on the path of commands"
