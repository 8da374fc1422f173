"""What people are told: how a process ended, and who has stopped the robot."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.base.levels import Level
from rbxcompose.runtime import channel as say
from rbxcompose.sdk.component import RobotHeld
from tests.runtime.stage import Stage


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
