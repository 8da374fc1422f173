"""What the supervisor decides, in virtual time and without processes."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.levels import Level
from rbxcompose.base.requests import as_data
from rbxcompose.compiler.plan.model import BusPlan, Plan
from rbxcompose.missions.execution.requests import RunMission
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.folder import RunOptions
from rbxcompose.runtime.supervision.members import Phase
from rbxcompose.sdk.component import MissionOver, RobotHeld
from tests.runtime.stage import ENDPOINT, Stage, placed, robot

# The beginning


def test_all_processes_are_forked_at_once_and_configured_when_the_router_listens() -> None:
    stage = Stage()
    assert [name for name, *_ in stage.forks] == ["router", "world", "robot", "mission"]
    assert stage.told(say.Configure) == ["router"]
    stage.configure("router")
    assert stage.sent[1:] == [(name, say.Configure(ENDPOINT)) for name in ("world", "robot", "mission")]


def test_with_an_existing_router_none_is_started() -> None:
    plan = Plan("robot", "robot.yaml", robot().instances, BusPlan(router="tcp/10.0.0.1:7447"))
    stage = Stage(plan, router=None)
    assert [name for name, *_ in stage.forks] == ["world", "robot", "mission"]
    assert stage.sent == [(name, say.Configure("tcp/10.0.0.1:7447")) for name in ("world", "robot", "mission")]


def test_nothing_is_activated_before_all_are_configured() -> None:
    stage = Stage()
    stage.configure("router", "world", "robot")
    assert stage.told(say.Activate) == []
    stage.configure("mission")
    assert stage.orders(say.Activate) == [("world", say.Activate(["base"]))]


def test_components_are_activated_in_the_order_of_the_plan() -> None:
    stage = Stage().start()
    expected = [("world", ["base"]), ("robot", ["mux", "go_to"]), ("mission", ["mission"])]
    assert stage.orders(say.Activate) == [(process, say.Activate(names)) for process, names in expected]


def test_who_starts_after_one_that_may_take_its_time_waits_until_that_is_active() -> None:
    prepare, other = (placed(name, "program", "programs", command=["./x"]) for name in ("prepare", "other"))
    late = replace(placed("late", "program", "programs", command=["./x"]), starts_after=("prepare",))
    stage = Stage(Plan("robot", "robot.yaml", (prepare, late, other)))
    stage.configure("router", "programs")
    assert stage.orders(say.Activate) == [("programs", say.Activate(["prepare", "other"]))]
    stage.speak("programs", say.States({"other": ("active", 0)}))
    assert len(stage.orders(say.Activate)) == 1
    stage.speak("programs", say.States({"prepare": ("active", 0)}))
    assert stage.orders(say.Activate)[1:] == [("programs", say.Activate(["late"]))]
    stage.exit("programs")
    stage.pass_time(0.2)
    stage.configure("programs")
    assert stage.orders(say.Activate)[2:] == [("programs", say.Activate(["prepare", "other"]))]
    stage.speak("programs", say.States({"other": ("active", 1)}))
    assert len(stage.orders(say.Activate)) == 3
    stage.speak("programs", say.States({"prepare": ("active", 1)}))
    assert stage.orders(say.Activate)[3:] == [("programs", say.Activate(["late"]))]


def test_the_robot_starts_once_all_are_active() -> None:
    stage = Stage()
    stage.configure("router", "world", "robot", "mission")
    assert (stage.ups, stage.told(say.Start)) == (0, [])
    stage.activate()
    assert (stage.ups, stage.told(say.Start)) == (1, ["world", "robot", "mission"])
    assert stage.conductor.phase is Phase.RUNNING


def test_the_robot_is_told_to_be_up_before_anything_starts_that_could_tell_of_itself() -> None:
    class Noting(Stage):
        def is_up(self) -> None:
            super().is_up()
            assert self.told(say.Start) == []

    assert Noting().start().ups == 1


def test_a_component_that_is_restarted_in_place_delays_the_start() -> None:
    stage = Stage()
    stage.configure("router", "world", "robot", "mission")
    stage.speak("world", say.States({"base": ("unconfigured", 1)}))
    assert stage.told(say.Activate) == ["world"]
    stage.speak("world", say.States({"base": ("active", 1)}))
    assert stage.told(say.Activate) == ["world", "robot"]
    assert stage.conductor.states["base"] == ("active", 1)


def test_a_component_that_fails_ends_the_start_with_its_reason() -> None:
    stage = Stage()
    stage.configure("router", "world", "robot", "mission")
    stage.speak("robot", say.Failed("mux", "'mux' failed too often: no"))
    assert (stage.conductor.exit_code, stage.conductor.reason) == (4, "'mux' failed too often: no")
    assert stage.conductor.is_going_down


# The end


def test_the_end_of_the_mission_ends_the_robot_in_the_foreground() -> None:
    for outcome, code in (("success", 0), ("failure", 3)):
        stage = Stage().start()
        stage.speak("mission", MissionOver("patrol", outcome))
        assert (stage.conductor.is_going_down, stage.conductor.exit_code) == (True, code)


def test_a_detached_robot_stays_up_when_its_mission_has_ended() -> None:
    stage = Stage(options=RunOptions(is_detached=True)).start()
    stage.speak("mission", MissionOver("patrol", "failure"))
    assert not stage.conductor.is_going_down


def test_in_real_time_the_duration_counts_from_the_start_of_robot_time() -> None:
    stage = Stage(options=RunOptions(duration=3.0)).start()
    stage.pass_time(2.9)
    assert not stage.conductor.is_going_down
    stage.pass_time(0.2)
    assert (stage.conductor.is_going_down, stage.conductor.exit_code) == (True, 0)


def test_going_down_brakes_all_waits_for_rest_and_closes_in_reverse_order() -> None:
    stage = Stage().start()
    stage.conductor.go_down(0, "asked")
    assert stage.told(say.Brake) == ["world", "robot", "mission"]
    for process in ("mission", "world"):
        stage.speak(process, say.AtRest())
    assert stage.told(say.Shutdown) == []
    stage.speak("robot", say.AtRest())
    for process in ("mission", "robot", "world", "router"):
        assert stage.told(say.Shutdown)[-1] == process
        stage.exit(process, "ended with status 0")
    assert stage.conductor.phase is Phase.ENDED
    assert (stage.killed, stage.forks[4:]) == ([], [])


def test_what_does_not_come_to_rest_is_closed_after_a_second_and_what_does_not_close_is_killed_within_two() -> None:
    stage = Stage().start()
    stage.conductor.go_down(0, "asked")
    stage.scheduler.advance(stage.scheduler.now + 0.99)
    assert stage.told(say.Shutdown) == []
    stage.scheduler.advance(stage.scheduler.now + 0.02)
    assert stage.told(say.Shutdown) == ["mission"]
    stage.scheduler.advance(stage.scheduler.now + 0.95)
    assert stage.killed == ["router", "world", "robot", "mission"]


def test_before_anything_is_configured_processes_are_ended_at_once() -> None:
    stage = Stage()
    stage.conductor.go_down(130, "interrupted")
    assert stage.ended == ["world", "robot", "mission"]
    for process in ("robot", "world", "mission"):
        stage.exit(process, "ended with status 0")
    assert stage.ended[-1] == "router"
    stage.exit("router", "ended with status 0")
    assert (stage.conductor.phase, stage.conductor.exit_code) == (Phase.ENDED, 130)


def test_the_first_reason_counts() -> None:
    stage = Stage().start()
    stage.conductor.go_down(3, "the mission failed")
    stage.conductor.go_down(0, "asked")
    assert (stage.conductor.exit_code, stage.conductor.reason) == (3, "the mission failed")


@given(st.permutations(["router", "world", "robot", "mission"]), st.integers(0, 4))
def test_it_always_ends_once_all_have_exited(order: list[str], configured: int) -> None:
    stage = Stage()
    stage.configure(*["router", "world", "robot", "mission"][:configured])
    stage.conductor.go_down(0, "asked")
    for process in order:
        assert stage.conductor.phase is not Phase.ENDED
        stage.exit(process)
    assert stage.conductor.phase is Phase.ENDED


# Faults


def test_a_dead_process_is_forked_again_and_the_others_hear_of_it() -> None:
    stage = Stage().start()
    stage.exit("robot")
    heard = say.Lost(["mux", "go_to"], "process 'robot' was killed by SIGKILL")
    assert stage.orders(say.Lost) == [("world", heard), ("mission", heard)]
    assert len(stage.forks) == 4
    stage.scheduler.advance(stage.scheduler.now + 0.1)
    assert stage.forks[4:] == [("robot", True, False)]
    stage.configure("robot")
    assert stage.orders(say.Activate)[-1] == ("robot", say.Activate(["mux", "go_to"]))
    stage.speak("robot", say.States({"mux": ("active", 0), "go_to": ("active", 0)}))
    assert stage.told(say.Start) == ["world", "robot", "mission", "robot"]
    assert stage.ups == 1


@pytest.mark.parametrize("is_over", [False, True])
def test_a_mission_begins_again_after_a_crash_unless_it_was_over(is_over: bool) -> None:
    stage = Stage(options=RunOptions(is_detached=True)).start()
    if is_over:
        stage.speak("mission", MissionOver("patrol", "halted"))
    stage.exit("mission")
    stage.scheduler.advance(stage.scheduler.now + 0.1)
    stage.configure("mission")
    stage.speak("mission", say.States({"mission": ("active", 0)}))
    assert stage.orders(say.Start)[-1] == ("mission", say.Start(starts_mission=not is_over))


def test_a_process_that_comes_again_to_a_stopped_robot_is_told_so() -> None:
    stage = Stage().start()
    stage.conductor.stop("a person")
    assert stage.told(say.Stop) == ["world", "robot", "mission"]
    stage.exit("mission")
    stage.scheduler.advance(stage.scheduler.now + 0.1)
    assert stage.forks[-1] == ("mission", True, True)


def test_a_component_that_needs_the_robot_to_stand_still_stops_all_other_processes() -> None:
    stage = Stage().start()
    stage.speak("robot", RobotHeld("go_to", "a child is near"))
    assert stage.conductor.is_stopped
    assert stage.told(say.Stop) == ["world", "mission"]  # its own has stopped before it told
    assert stage.conductor.latch.holds == {"go_to": "a child is near"}
    stage.speak("robot", RobotHeld("go_to", ""))
    assert stage.conductor.is_stopped
    assert stage.conductor.latch.holds == {}
    stage.conductor.release()
    assert stage.told(say.Release) == ["world", "robot", "mission"]


def test_a_stop_reaches_a_process_that_was_being_started_before_any_of_it_is_active() -> None:
    stage = Stage().start()
    stage.exit("robot")
    stage.scheduler.advance(stage.scheduler.now + 0.1)
    stage.conductor.stop("a person")
    stage.configure("robot")
    orders = [message for process, message in stage.sent if process == "robot"]
    assert orders[-2:] == [say.Stop(), say.Activate(["mux", "go_to"])]


def test_a_release_reaches_a_process_that_was_being_started_during_a_stop() -> None:
    stage = Stage().start()
    stage.conductor.stop("a person")
    stage.exit("robot")
    stage.scheduler.advance(stage.scheduler.now + 0.1)
    stage.conductor.release()
    stage.configure("robot")
    orders = [message for process, message in stage.sent if process == "robot"]
    assert orders[-2:] == [say.Release(), say.Activate(["mux", "go_to"])]


def test_one_restart_does_not_wait_for_the_trouble_of_another() -> None:
    stage = Stage().start()
    stage.speak("world", say.States({"base": ("unconfigured", 1)}))
    stage.exit("mission")
    stage.scheduler.advance(stage.scheduler.now + 0.1)
    stage.configure("mission")
    assert stage.orders(say.Activate)[-1] == ("mission", say.Activate(["mission"]))


def test_five_deaths_within_a_minute_fail_the_robot() -> None:
    stage = Stage().start()
    for _ in range(4):
        stage.exit("mission")
        stage.scheduler.advance(stage.scheduler.now + 5.0)
        assert not stage.conductor.is_going_down
    stage.exit("mission")
    assert (stage.conductor.is_going_down, stage.conductor.exit_code) == (True, 4)


def test_five_deaths_of_a_process_that_is_never_configured_fail_the_robot_however_long_each_takes() -> None:
    stage = Stage()
    stage.configure("router", "world", "mission")
    for _ in range(5):
        assert not stage.conductor.is_going_down
        stage.pass_time(31.0)
        stage.exit("robot", "hung for 30 s in configure of 'mux' and ended itself")
    assert (stage.conductor.is_going_down, stage.conductor.exit_code) == (True, 4)
    assert "in configure of 'mux' and ended itself, too often" in stage.conductor.reason


def test_deaths_far_apart_do_not_fail_the_robot() -> None:
    stage = Stage().start()
    for _ in range(8):
        stage.exit("mission")
        stage.pass_time(1.0)
        stage.configure("mission")
        stage.pass_time(30.0)
    assert not stage.conductor.is_going_down


def test_without_simulated_truth_the_robot_fails() -> None:
    stage = Stage().start()
    stage.exit("world")
    assert (stage.conductor.is_going_down, stage.conductor.exit_code) == (True, 4)
    assert "world" in stage.conductor.reason


def test_a_lost_router_comes_again_where_it_was() -> None:
    stage = Stage().start()
    stage.exit("router")
    stage.scheduler.advance(stage.scheduler.now + 0.1)
    assert stage.sent[-1] == ("router", say.Configure(ENDPOINT))
    assert stage.told(say.Lost) == []


def test_silence_is_told_after_one_second_and_ends_a_process_after_two() -> None:
    stage = Stage().start()
    stage.beats.discard("robot")
    stage.pass_time(0.9)
    assert stage.told(say.Lost) == []
    stage.pass_time(0.5)
    assert stage.told(say.Lost) == ["world", "robot", "mission"]
    assert stage.killed == []
    stage.pass_time(1.0)
    assert stage.killed == ["robot"]


def test_a_process_that_answers_again_is_left_alone() -> None:
    stage = Stage().start()
    stage.beats.discard("robot")
    stage.pass_time(1.5)
    stage.beats.add("robot")
    stage.pass_time(5.0)
    assert stage.killed == []
    assert stage.records == [(Level.WARN, "process 'robot' answers again")]


def test_a_process_that_still_configures_may_be_silent() -> None:
    stage = Stage()
    stage.configure("router", "world", "mission")
    stage.beats.discard("robot")
    stage.pass_time(20.0)
    assert stage.killed == []


def test_a_process_that_a_signal_suspends_is_told_at_once_and_ended_after_two_seconds() -> None:
    stage = Stage().start()
    stage.beats.discard("robot")
    stage.suspended = {"robot"}
    stage.pass_time(0.3)
    assert {order.cause for _, order in stage.sent if isinstance(order, say.Lost)} == {
        "process 'robot' was suspended by a signal"
    }
    assert stage.killed == []
    stage.pass_time(2.0)
    assert stage.killed == ["robot"]
    stage.exit("robot")
    assert stage.records[-1][1] == "process 'robot' was suspended by a signal for 2 s and was killed; restarting it"


def test_a_process_that_is_suspended_while_it_gets_ready_is_ended_and_one_that_takes_long_is_not() -> None:
    stage = Stage().start()
    stage.exit("robot")
    stage.pass_time(0.2)
    assert stage.forks[-1][0] == "robot"
    stage.beats.discard("robot")
    stage.pass_time(5.0)
    assert stage.killed == []
    stage.suspended = {"robot"}
    stage.pass_time(0.3)
    assert stage.killed == ["robot"]


def test_a_supervisor_that_was_held_up_blames_nobody_for_it() -> None:
    stage = Stage().start()
    stage.pass_time(1.0)
    stage.scheduler.advance(stage.scheduler.now + 30.0)
    assert (stage.killed, stage.told(say.Lost)) == ([], [])
    stage.beats.discard("robot")
    stage.pass_time(2.5)
    assert stage.killed == ["robot"]


def test_on_a_stepped_clock_nobody_looks_for_silence() -> None:
    stage = Stage(options=RunOptions(is_stepped=True)).start()
    assert stage.scheduler.next_due() is None


def test_on_a_stepped_clock_the_end_of_a_process_ends_the_robot_but_that_of_the_router_does_not() -> None:
    stage = Stage(options=RunOptions(is_stepped=True)).start()
    stage.exit("router")
    assert not stage.conductor.is_going_down
    stage.exit("robot", "hung for 30 s in step of 'lidar' and ended itself")
    assert stage.conductor.exit_code == 4
    assert stage.conductor.reason.startswith("process 'robot' hung for 30 s in step of 'lidar' and ended itself")


def test_a_failure_is_told_with_the_time_at_which_it_happened() -> None:
    stage = Stage(options=RunOptions(is_stepped=True)).start()
    stage.speak("robot", say.Failed("mux", "'mux' failed too often: no", 1.5))
    assert stage.conductor.time == 1.5


# Facts


def test_facts_and_time_come_from_the_processes() -> None:
    stage = Stage().start()
    stage.speak("world", say.Summary(12.5, {"base": {"distance": "8.0 m"}}))
    assert (stage.conductor.time, stage.conductor.facts) == (12.5, {"base": {"distance": "8.0 m"}})


def test_the_router_has_no_robot_time() -> None:
    stage = Stage(options=RunOptions(is_stepped=True)).start()
    stage.speak("router", say.Alive(80.0))  # while code is compiled, stepped time stands still
    stage.speak("world", say.Summary(2.45, {}))
    assert stage.conductor.time == 2.45


def test_answers_reach_who_asked() -> None:
    stage = Stage().start()
    stage.speak("mission", say.Answered(7, {"next": 3}))
    stage.speak("mission", say.Refusal(8, "not now"))
    assert stage.answers == [(7, {"next": 3}, False), (8, "not now", True)]


def test_a_process_that_was_killed_is_told_again_what_people_had_begun() -> None:
    stage = Stage().start()
    begun = as_data(RunMission("patrol"))
    stage.speak("mission", say.Repeated("mission", [begun]))
    stage.exit("mission")
    stage.scheduler.advance(stage.scheduler.now + 0.1)
    stage.configure("mission")
    stage.speak("mission", say.States({"mission": ("active", 1)}))
    assert stage.orders(say.Ask) == [("mission", say.Ask(0, "mission", begun))]


def test_a_process_that_was_killed_gets_back_what_was_set_while_it_ran() -> None:
    stage = Stage().start()
    live = say.SettingsKept("mission", "as text")
    stage.speak("mission", live)
    for known in ([("mission", live)], []):
        stage.sent.clear()
        stage.exit("mission")
        stage.scheduler.advance(stage.scheduler.now + 0.5)
        stage.configure("mission")
        assert stage.orders(say.SettingsKept) == known
        stage.speak("mission", say.SettingsKept("mission", ""))


def test_a_router_that_finds_no_port_ends_the_robot_with_its_reason() -> None:
    stage = Stage()
    stage.speak("router", say.Failed("", "no port is free"))
    assert (stage.conductor.exit_code, stage.conductor.reason) == (4, "no port is free")
