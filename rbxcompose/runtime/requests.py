"""What the supervisor answers at its control socket."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Protocol

from rbxcompose.components.mission import MissionConfig
from rbxcompose.diagnostics.levels import Level
from rbxcompose.plan.model import Plan
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.conductor import FINE, Conductor
from rbxcompose.runtime.folder import State


class Answers(Protocol):
    """Where answers go, by the number of the request."""

    def answer(self, number: int, answer: object) -> None:
        """Answer a request."""
        ...

    def refuse(self, number: int, reason: str) -> None:
        """Refuse a request."""
        ...


class Supervised(Protocol):
    """What requests can do with a supervisor."""

    plan: Plan
    conductor: Conductor

    def state(self) -> State:
        """Return what is known from outside."""
        ...

    def send(self, process: str, message: say.Order) -> None:
        """Send a message to a process."""
        ...

    def log(self, level: Level, text: str, detail: str = "") -> None:
        """Write a record of the whole robot."""
        ...


class Requests:
    """Carries out the requests of the command line and of whoever else this user lets in."""

    def __init__(self, supervisor: Supervised, answers: Answers, *, is_stepped: bool) -> None:
        """On a stepped clock the process group writes what came from outside, at its own time."""
        self._supervisor, self._answers, self._is_stepped = supervisor, answers, is_stepped
        self._verbs: dict[str, Callable[[int, dict[str, object]], None]] = {
            "ps": self._ps,
            "stop": self._stop,
            "release": self._release,
            "missions": self._missions,
            "command": self._command,
            "down": self._down,
        }

    def handle(self, request: dict[str, object], number: int) -> None:
        """Carry out a request; its answer comes now or later."""
        verb = str(request.get("verb"))
        if verb not in self._verbs:
            self._answers.refuse(number, f"there is no request '{verb}'")
        elif self._supervisor.conductor.is_going_down and verb not in ("ps", "missions", "down"):
            self._answers.refuse(number, "the robot is going down")
        else:
            self._verbs[verb](number, request)

    def _ps(self, number: int, request: dict[str, object]) -> None:
        self._answers.answer(number, asdict(self._supervisor.state()))

    def _stop(self, number: int, request: dict[str, object]) -> None:
        self._tell("stop: all that moves is held until 'release'")
        self._supervisor.conductor.stop()
        self._answers.answer(number, "stopped; 'release' allows motion again")

    def _release(self, number: int, request: dict[str, object]) -> None:
        if not self._supervisor.conductor.is_stopped:
            self._answers.refuse(number, "the robot is not stopped")
            return
        self._tell("release: motion is allowed again")
        self._supervisor.conductor.release()
        self._answers.answer(number, "released; 'mission resume' goes on")

    def _missions(self, number: int, request: dict[str, object]) -> None:
        plan = self._supervisor.plan
        configs = [one.config for one in plan.instances if isinstance(one.config, MissionConfig)]
        programs = [program for config in configs for program in config.programs.items()]
        listed = [{"name": name, "about": one.about, "starts": name == plan.start} for name, one in programs]
        self._answers.answer(number, listed)

    def _command(self, number: int, request: dict[str, object]) -> None:
        """Pass a person's word on to the component of type `to`; that one answers."""
        type_name, word = str(request.get("to")), str(request.get("word"))
        found = next((one for one in self._supervisor.plan.instances if one.type == type_name), None)
        if found is None:
            self._answers.refuse(number, f"this robot has no component of type '{type_name}'")
        elif self._supervisor.conductor.states[found.name][0] != "active":
            self._answers.refuse(number, f"'{found.name}' is not active")
        else:
            self._supervisor.send(found.process, say.Command(number, found.name, word))

    def _down(self, number: int, request: dict[str, object]) -> None:
        if not self._supervisor.conductor.is_going_down:
            self._tell("down: the robot goes down")
        self._supervisor.conductor.go_down(FINE, "asked to go down")
        self._answers.answer(number, "going down")

    def _tell(self, text: str) -> None:
        if not self._is_stepped:
            self._supervisor.log(Level.OK, text)
