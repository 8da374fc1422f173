"""What the supervisor answers, without processes."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, replace
from typing import Any, Literal

import pytest

from rbxcompose.base.config import Restart
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Command, Request, answers, as_data, from_data
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.compiler.plan.dump import dump
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.missions.execution.equipment import MissionConfig
from rbxcompose.missions.execution.requests import ListMissions, PauseMission
from rbxcompose.msgs import registry
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.channel import HostReport
from rbxcompose.runtime.folder import RobotState, RunOptions
from rbxcompose.runtime.plan_requests import AdoptSaved, ApplyPlan, ComparePlan, PlanComparison, RevertPlan
from rbxcompose.runtime.processes import Process
from rbxcompose.runtime.requests import BringDown, NoteInLog, ReleaseRobot, RobotStatus, StopRobot
from rbxcompose.runtime.supervision import request_handler
from rbxcompose.runtime.supervision.conductor import Conductor
from rbxcompose.runtime.supervision.plan_change import Fate
from rbxcompose.runtime.supervision.request_handler import RequestHandler
from rbxcompose.runtime.supervision.setting_changes import SettingChanges, WhenJudged
from rbxcompose.sdk import Component, Config, component
from rbxcompose.sdk.component import RobotHeld
from rbxcompose.testing.bench import Bench, instance
from tests.loops import for_all
from tests.missions.simulated import program_of

PLAN = Plan("toys", "toys.yaml", (Instance("patrol", "mission", MissionConfig(), "mission"),))


@dataclass(frozen=True, slots=True)
class Juggle(Command):
    about = "juggler"
    balls: int = 3


@component("toy_juggler")
class Juggler(Component[Config]):
    """A component of a stranger, with a request of its own."""

    @answers(Juggle)
    def juggle(self, request: Juggle) -> str:
        return f"{request.balls} balls"


class Desk:
    """A supervisor without processes: everything that it would do is noted."""

    def __init__(self, plan: Plan = PLAN, *, is_stepped: bool = False) -> None:
        self.run_id = "this run"
        self.sent: list[tuple[str, say.ChannelOrder]] = []
        self.texts: list[str] = []
        self.replies: list[tuple[int, object, bool]] = []
        self.conductor = Conductor(plan, RunOptions(is_stepped=is_stepped), Scheduler(), self, router=None)
        self.handler = RequestHandler(self, SettingChanges(self), is_stepped=is_stepped)
        self.conductor.states["patrol"] = ("active", 0)
        self.conductor.members["mission"].is_configured = True

    def state(self) -> RobotState:
        return RobotState("toys", "/toys.yaml", Process.of(os.getpid()), {}, ())

    def send(self, process: str, message: say.ChannelOrder) -> None:
        self.sent.append((process, message))

    def plan(self) -> Plan:
        return self.conductor.plan

    def reached(self) -> list[str]:
        return self.conductor.reached

    def judge(self, now: list[str], new: list[str], then: WhenJudged) -> None:
        then(None)

    def log(self, level: Level, text: str, detail: str = "") -> None:
        self.texts.append(text)

    def refuse(self, number: int, reason: str) -> None:
        self.replies.append((number, reason, True))

    def answer(self, number: int, answer: object) -> None:
        self.replies.append((number, answer, False))

    def fork(self, process: str, *, is_restart: bool, is_stopped: bool) -> None:
        raise AssertionError("no process is to be forked")

    def to_hosts(self, report: HostReport) -> None: ...

    def end(self, process: str) -> None:
        raise AssertionError("no process is to be ended")

    def kill(self, process: str) -> None:
        raise AssertionError("no process is to be killed")

    def is_suspended(self, process: str) -> bool:
        return False

    def waits(self, process: str | None) -> dict[str, float]:
        return {}

    def states_changed(self) -> None:
        pass

    def is_up(self) -> None:
        raise AssertionError("it is not up")

    def ask(self, request: Request[Any]) -> tuple[object, bool]:
        """Return answer and refusal of a request that is answered at once."""
        self.handler.handle(as_data(request), 1)
        _, answer, is_refused = self.replies.pop()
        return answer, is_refused

    def compare(self, plan: str, considered: say.Considered | None = None) -> PlanComparison:
        """Return what a plan would change, as it comes to who asked; the components have `considered` it."""
        self.handler.handle(as_data(ComparePlan(plan)), 1)
        if considered is not None:
            self.handler.consultations.receive("mission", considered)
        _, answer, is_refused = self.replies.pop()
        assert not is_refused
        found: PlanComparison = from_data(ComparePlan.answer_type(), json.loads(json.dumps(answer)))
        return found


def test_stop_reaches_all_and_is_told() -> None:
    for request, by in ((StopRobot(), "the command 'stop'"), (StopRobot(by="the console"), "the console")):
        desk = Desk()
        assert desk.ask(request) == ("stopped; 'release' allows motion again", False)
        assert desk.sent == [("mission", say.Stop())]
        assert desk.texts == ["stop: all motion is held until 'release'"]
        assert desk.conductor.latch.state is not None
        assert desk.conductor.latch.state.by == by


def test_release_opens_a_stop_and_nothing_else() -> None:
    desk = Desk()
    assert desk.ask(ReleaseRobot()) == ("the robot is not stopped", True)
    desk.ask(StopRobot())
    assert desk.ask(ReleaseRobot())[1] is False
    assert desk.sent[-1] == ("mission", say.Release())


def test_release_is_refused_with_the_reason_while_a_component_needs_the_robot_to_stand_still() -> None:
    desk = Desk()
    desk.conductor.receive("mission", RobotHeld("estop", "'estop' is pressed"))
    assert desk.ask(ReleaseRobot()) == ("the robot must stand still: 'estop' is pressed", True)
    desk.conductor.receive("mission", RobotHeld("estop", ""))
    assert desk.ask(ReleaseRobot())[1] is False


def test_what_others_do_is_noted_on_one_line() -> None:
    desk = Desk()
    assert desk.ask(NoteInLog("somebody:\nasks")) == ("noted", False)
    ((noted,),) = (desk.texts,)
    assert noted.startswith("somebody:")
    assert "\n" not in noted


def test_the_status_comes_back_as_it_was() -> None:
    desk = Desk()
    status, _ = desk.ask(RobotStatus())
    assert from_data(RobotStatus.answer_type(), status) == desk.state()


def test_a_command_goes_to_the_component_that_takes_it_which_answers() -> None:
    desk = Desk()
    desk.handler.handle(as_data(PauseMission()), 5)
    assert desk.sent == [("mission", say.Ask(5, "patrol", as_data(PauseMission())))]
    assert desk.replies == []


def test_a_component_of_a_stranger_brings_requests_of_its_own() -> None:
    desk = Desk(replace(PLAN, instances=(*PLAN.instances, Instance("clown", "toy_juggler", Config(), "ring"))))
    desk.conductor.states["clown"] = ("active", 0)
    desk.handler.handle(as_data(Juggle(5)), 5)
    ((process, asked),) = desk.sent
    assert (process, asked) == ("ring", say.Ask(5, "clown", as_data(Juggle(5))))
    host = Bench(instance("clown", "toy_juggler")).host
    assert host.ask("clown", host.request("clown", as_data(Juggle(5)))) == "5 balls"


def test_a_command_that_nobody_can_take_is_refused() -> None:
    desk = Desk()
    assert desk.ask(Juggle()) == ("this robot has no component of type 'juggler'", True)
    desk.conductor.states["patrol"] = ("unconfigured", 1)
    assert desk.ask(PauseMission()) == ("'patrol' is not active", True)


def test_a_robot_that_goes_down_takes_no_more_commands_but_answers_questions() -> None:
    desk = Desk()
    desk.ask(BringDown())
    assert desk.conductor.is_going_down
    for command in (StopRobot(), PauseMission(), ComparePlan("")):
        assert desk.ask(command) == ("the robot is going down", True)
    assert desk.ask(BringDown()) == ("going down", False)
    assert desk.ask(RobotStatus())[1] is False
    desk.handler.handle(as_data(ListMissions()), 5)
    assert desk.sent[-1] == ("mission", say.Ask(5, "patrol", as_data(ListMissions())))


@for_all(
    "data, reason",
    [
        ({"verb": "stop"}, "this version of rbxcompose has no such request"),
        (["stop"], "this version of rbxcompose has no such request"),
        (7, "this version of rbxcompose has no such request"),
        ({"type": "dance"}, "there is no request 'dance'"),
        ({"type": "robot.Dance"}, "there is no request 'robot.Dance'"),
        ({"type": "mission.Dance"}, "there is no request 'mission.Dance'"),
        (
            {"type": "robot.StopRobot", "force": True},
            "the request 'robot.StopRobot' cannot be read: 'force' is not known here",
        ),
        (
            {"type": "robot.ApplyPlan", "plan": ""},
            "the request 'robot.ApplyPlan' cannot be read: 'generation' is missing",
        ),
        (
            {"type": "robot.ApplyPlan", "plan": 5, "generation": 0},
            "the request 'robot.ApplyPlan' cannot be read: 'plan' is not text",
        ),
        (
            {"type": "mission.RunMission", "mission": "patrol", "inputs": {"rounds": [1]}},
            "the request 'mission.RunMission' cannot be read: 'inputs.rounds' is not text",
        ),
    ],
)
def test_what_is_no_request_of_this_version_is_refused_with_the_reason(data: object, reason: str) -> None:
    desk = Desk()
    desk.handler.handle(data, 1)
    assert desk.replies == [(1, reason, True)]
    assert desk.sent == []


def test_on_a_stepped_clock_the_process_tells_the_command_itself() -> None:
    desk = Desk(is_stepped=True)
    desk.ask(StopRobot())
    assert desk.texts == []


def test_another_plan_is_compared_first_and_taken_only_if_nobody_was_faster() -> None:
    desk = Desk()
    desk.conductor._is_running = True
    text = dump(replace(PLAN, instances=(replace(PLAN.instances[0], restart=Restart(when="never")),)))
    found = desk.compare(text, say.Considered(1, ["goes on"], []))
    assert found.said == ("goes on",)
    assert (found.generation, found.why_not) == (0, "")
    assert [change.fate for change in found.components] == [Fate.LIVE]
    assert str(desk.ask(ApplyPlan(text, 7))[0]).startswith("it was changed by someone else meanwhile")
    assert [type(message) for _, message in desk.sent] == [say.Consider]


def test_a_question_that_fails_by_a_bug_of_ours_ends_no_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk()
    monkeypatch.setattr(request_handler, "changes", lambda *_: 1 / 0)
    assert desk.ask(ComparePlan(dump(PLAN))) == ("ZeroDivisionError: division by zero", True)
    assert any("a question was not answered" in text for text in desk.texts)


def test_a_change_that_a_component_refuses_touches_nothing() -> None:
    desk = Desk()
    desk.conductor._is_running = True
    text = dump(replace(PLAN, instances=(replace(PLAN.instances[0], restart=Restart(when="never")),)))
    assert desk.compare(text, say.Considered(1, [], ["it runs"])).why_not == "it runs"
    desk.handler.handle(as_data(ApplyPlan(text, 0)), 1)
    assert desk.replies == []  # it waits
    desk.handler.consultations.receive("mission", say.Considered(2, [], ["it runs"]))
    assert desk.replies == [(1, "it runs", True)]
    assert [type(message) for _, message in desk.sent] == [say.Consider, say.Consider]


def test_a_mission_that_runs_and_would_be_gone_is_to_be_cancelled_and_not_to_be_paused() -> None:
    desk = Desk()
    desk.conductor._is_running = True
    desk.conductor.members["mission"].runs = {"patrol": "mission look runs"}
    other = MissionConfig(programs={"look": program_of("do: {wait: 1 s}")})
    text = dump(replace(PLAN, instances=(replace(PLAN.instances[0], config=other),)))
    assert desk.compare(text, say.Considered(1, [], ["cancel it first"])).why_not == "cancel it first"
    desk.handler.handle(as_data(ApplyPlan(text, 0)), 1)
    desk.handler.consultations.receive("mission", say.Considered(2, [], ["cancel it first"]))
    assert desk.replies == [(1, "cancel it first", True)]
    found = desk.compare(text, say.Considered(3, [], []))
    assert found.why_not.startswith("mission look runs, and 'patrol' would restart")


def test_changes_are_taken_back_one_after_the_other() -> None:
    desk = Desk()
    desk.conductor._is_running = True
    whens: tuple[Literal["never", "always"], ...] = ("never", "always")
    texts = [dump(replace(PLAN, instances=(replace(PLAN.instances[0], restart=Restart(when=one)),))) for one in whens]
    steps = [ApplyPlan(texts[0], 0), ApplyPlan(texts[1], 1), RevertPlan(1), RevertPlan()]
    shown = []
    for number, request in enumerate(steps, 1):
        desk.handler.handle(as_data(request), number)
        desk.handler.consultations.receive("mission", say.Considered(number, [], []))
        desk.conductor.receive("mission", say.Reconfigured({}))
        shown.append(desk.conductor.plan.instances[0].restart.when)
    assert [is_refused for _, _, is_refused in desk.replies] == [False] * 4
    assert shown == ["never", "always", "never", PLAN.instances[0].restart.when]
    assert desk.ask(RevertPlan()) == ("there is no such change to take back", True)


def test_a_process_that_ends_has_nothing_to_say_about_a_change() -> None:
    desk = Desk()
    desk.conductor._is_running = True
    text = dump(replace(PLAN, instances=(replace(PLAN.instances[0], restart=Restart(when="never")),)))
    desk.handler.handle(as_data(ComparePlan(text)), 1)
    desk.handler.consultations.gone("mission")
    assert [is_refused for _, _, is_refused in desk.replies] == [False]


def test_a_robot_keeps_its_types_while_another_plan_is_compared() -> None:
    with registry.choosing({"toy_msgs/msg/Ball": "float64 size"}):
        Desk().compare(dump(PLAN))
        assert registry.message("toy_msgs/Ball")


def test_a_text_that_is_no_plan_is_refused() -> None:
    for request in (ComparePlan("{}"), ApplyPlan("{}", 0), AdoptSaved("{}", {})):
        assert Desk().ask(request) == ("this is not a plan of version 1", True)


@pytest.mark.parametrize(
    ("plan", "names", "reason"),
    [
        (PLAN, {"patrol": ["speed"]}, "the robot has no such settings"),
        (replace(PLAN, instances=()), {"patrol": ["start"]}, "the robot has no such settings"),
        (
            replace(PLAN, instances=(replace(PLAN.instances[0], config=MissionConfig(for_others=True)),)),
            {"patrol": ["for_others"]},
            "they are not live",
        ),
    ],
)
def test_saved_values_of_what_is_no_live_setting_are_refused(
    plan: Plan, names: dict[str, list[str]], reason: str
) -> None:
    desk = Desk()
    desk.conductor._is_running = True
    assert desk.ask(AdoptSaved(dump(plan), names)) == (reason, True)


def test_what_cannot_be_done_now_is_refused_with_the_reason() -> None:
    desk = Desk(is_stepped=True)
    desk.conductor._is_running = True
    assert desk.compare(dump(replace(PLAN, start="other"))).why_not == ""  # nothing that runs would be other
    text = dump(replace(PLAN, instances=(replace(PLAN.instances[0], process="other"),)))
    assert str(desk.ask(ApplyPlan(text, 0))[0]).startswith("it runs on a stepped clock")
