"""What the supervisor answers, without processes."""

from __future__ import annotations

import os
from dataclasses import replace

from rbxcompose.components.mission import MissionConfig
from rbxcompose.diagnostics.levels import Level
from rbxcompose.plan.dump import dump
from rbxcompose.plan.model import Instance, Plan
from rbxcompose.restarts import Restart
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.conductor import Conductor
from rbxcompose.runtime.folder import State
from rbxcompose.runtime.options import RunOptions
from rbxcompose.runtime.processes import Process
from rbxcompose.runtime.requests import Requests
from rbxcompose.scheduler import Scheduler

PLAN = Plan("toys", "toys.yaml", (Instance("patrol", "mission", MissionConfig(), "mission"),))


class Desk:
    """A supervisor without processes: everything that it would do is noted."""

    def __init__(self, *, is_stepped: bool = False) -> None:
        self.sent: list[tuple[str, say.Order]] = []
        self.texts: list[str] = []
        self.replies: list[tuple[int, object, bool]] = []
        self.conductor = Conductor(PLAN, RunOptions(is_stepped=is_stepped), Scheduler(), self, router=None)
        self.requests = Requests(self, self, is_stepped=is_stepped)
        self.conductor.states["patrol"] = ("active", 0)
        self.conductor.members["mission"].is_configured = True

    def state(self) -> State:
        return State("toys", "/toys.yaml", Process.of(os.getpid()), {}, ())

    def send(self, process: str, message: say.Order) -> None:
        self.sent.append((process, message))

    def log(self, level: Level, text: str, detail: str = "") -> None:
        self.texts.append(text)

    def refuse(self, number: int, reason: str) -> None:
        self.replies.append((number, reason, True))

    def answer(self, number: int, answer: object, *, is_refused: bool = False) -> None:
        self.replies.append((number, answer, is_refused))

    def fork(self, process: str, *, is_restart: bool, is_stopped: bool) -> None:
        raise AssertionError("no process is to be forked")

    def end(self, process: str) -> None:
        raise AssertionError("no process is to be ended")

    def kill(self, process: str) -> None:
        raise AssertionError("no process is to be killed")

    def is_suspended(self, process: str) -> bool:
        return False

    def states_changed(self) -> None:
        pass

    def is_up(self) -> None:
        raise AssertionError("it is not up")

    def ask(self, **request: object) -> tuple[str, bool]:
        """Return answer and refusal of a request that is answered at once."""
        self.requests.handle(dict(request), 1)
        _, answer, is_refused = self.replies.pop()
        return str(answer), is_refused


def test_stop_reaches_all_and_is_told() -> None:
    desk = Desk()
    assert desk.ask(verb="stop") == ("stopped; 'release' allows motion again", False)
    assert desk.sent == [("mission", say.Stop())]
    assert desk.texts == ["stop: all that moves is held until 'release'"]
    assert desk.conductor.is_stopped


def test_release_opens_a_stop_and_nothing_else() -> None:
    desk = Desk()
    assert desk.ask(verb="release") == ("the robot is not stopped", True)
    desk.ask(verb="stop")
    assert desk.ask(verb="release")[1] is False
    assert desk.sent[-1] == ("mission", say.Release())


def test_a_command_goes_to_the_component_of_that_type_which_answers() -> None:
    desk = Desk()
    desk.requests.handle({"verb": "command", "to": "mission", "word": "pause"}, 5)
    assert desk.sent == [("mission", say.Command(5, "patrol", "pause"))]
    assert desk.replies == []


def test_a_command_that_nobody_can_take_is_refused() -> None:
    desk = Desk()
    assert desk.ask(verb="command", to="juggler", word="go") == ("this robot has no component of type 'juggler'", True)
    desk.conductor.states["patrol"] = ("unconfigured", 1)
    assert desk.ask(verb="command", to="mission", word="pause") == ("'patrol' is not active", True)


def test_a_robot_that_goes_down_takes_no_more_commands() -> None:
    desk = Desk()
    desk.ask(verb="down")
    assert desk.conductor.is_going_down
    assert desk.ask(verb="stop") == ("the robot is going down", True)
    assert desk.ask(verb="down") == ("going down", False)


def test_an_unknown_request_is_refused() -> None:
    assert Desk().ask(verb="dance") == ("there is no request 'dance'", True)


def test_on_a_stepped_clock_the_process_tells_the_command_itself() -> None:
    desk = Desk(is_stepped=True)
    desk.ask(verb="stop")
    assert desk.texts == []


def test_another_plan_is_compared_first_and_taken_only_if_nobody_was_faster() -> None:
    desk = Desk()
    desk.conductor._is_running = True
    text = dump(replace(PLAN, instances=(replace(PLAN.instances[0], restart=Restart(when="never")),)))
    desk.requests.handle({"verb": "changes", "plan": text}, 1)
    _, answer, is_refused = desk.replies.pop()
    assert isinstance(answer, dict)
    assert (is_refused, answer["generation"], answer["why_not"]) == (False, 0, "")
    assert [one["fate"] for one in answer["components"]] == ["changed live"]
    assert desk.ask(verb="apply", plan=text, generation=7)[0].startswith("it was changed by someone else meanwhile")
    assert desk.sent == []


def test_a_text_that_is_no_plan_is_refused() -> None:
    for verb in ("changes", "apply"):
        assert Desk().ask(verb=verb, plan="{}", generation=0) == ("this is no plan of version 1", True)


def test_what_cannot_be_done_now_is_refused_with_the_reason() -> None:
    desk = Desk(is_stepped=True)
    desk.conductor._is_running = True
    text = dump(replace(PLAN, start="other"))
    assert "'why_not': ''" in desk.ask(verb="changes", plan=text)[0]  # nothing that runs would be other
    text = dump(replace(PLAN, instances=(replace(PLAN.instances[0], process="other"),)))
    assert desk.ask(verb="apply", plan=text, generation=0)[0].startswith("it runs on a stepped clock")
