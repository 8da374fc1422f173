"""What the supervisor answers at its control socket."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Protocol

from rbxcompose.diagnostics.levels import Level
from rbxcompose.plan.dump import PlanTextError, load
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.changes import Changes, changes
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
            "command": self._command,
            "query": self._query,
            "changes": self._changes,
            "apply": self._apply,
            "down": self._down,
        }

    def handle(self, request: dict[str, object], number: int) -> None:
        """Carry out a request; its answer comes now or later."""
        verb = str(request.get("verb"))
        if verb not in self._verbs:
            self._answers.refuse(number, f"there is no request '{verb}'")
        elif self._supervisor.conductor.is_going_down and verb not in ("ps", "query", "down"):
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

    def _command(self, number: int, request: dict[str, object]) -> None:
        """Pass a person's word on to the component of type `to`; that one answers."""
        self._pass_on(number, request, say.Command)

    def _query(self, number: int, request: dict[str, object]) -> None:
        """Pass a question on to the component of type `to`; that one answers."""
        self._pass_on(number, request, say.Query)

    def _pass_on(self, number: int, request: dict[str, object], message: type[say.Command] | type[say.Query]) -> None:
        type_name, word = str(request.get("to")), str(request.get("word"))
        found = next((one for one in self._supervisor.conductor.plan.instances if one.type == type_name), None)
        if found is None:
            self._answers.refuse(number, f"this robot has no component of type '{type_name}'")
        elif self._supervisor.conductor.states[found.name][0] != "active":
            self._answers.refuse(number, f"'{found.name}' is not active")
        else:
            self._supervisor.send(found.process, message(number, found.name, word))

    def _changes(self, number: int, request: dict[str, object]) -> None:
        """Tell what another plan would change, and what speaks against it now; nothing happens."""
        if (found := self._compared(number, request)) is not None:
            conductor = self._supervisor.conductor
            why_not = "" if found.is_empty else conductor.why_not(found)
            self._answers.answer(number, {**found.data(), "generation": conductor.generation, "why_not": why_not})

    def _apply(self, number: int, request: dict[str, object]) -> None:
        """Let another plan hold; answered when all that is new is active."""
        found, conductor = self._compared(number, request), self._supervisor.conductor
        if found is None:
            return
        if request.get("generation") != conductor.generation:
            self._answers.refuse(number, "it was changed by someone else meanwhile: look at the difference again")
        elif why_not := conductor.why_not(found):
            self._answers.refuse(number, why_not)
        else:
            conductor.change(found, lambda text, is_refused: self._applied(number, text, is_refused=is_refused))

    def _compared(self, number: int, request: dict[str, object]) -> Changes | None:
        conductor = self._supervisor.conductor
        try:
            after = load(str(request.get("plan")))
        except PlanTextError as error:
            self._answers.refuse(number, str(error))
            return None
        failed = [name for name, (state, _) in conductor.states.items() if state == "failed"]
        return changes(conductor.plan, after, failed)

    def _applied(self, number: int, text: str, *, is_refused: bool) -> None:
        self._supervisor.log(Level.ERROR if is_refused else Level.OK, f"apply: {text}")
        if is_refused:
            self._answers.refuse(number, text)
        else:
            self._answers.answer(number, text)

    def _down(self, number: int, request: dict[str, object]) -> None:
        if not self._supervisor.conductor.is_going_down:
            self._tell("down: the robot goes down")
        self._supervisor.conductor.go_down(FINE, "asked to go down")
        self._answers.answer(number, "going down")

    def _tell(self, text: str) -> None:
        if not self._is_stepped:
            self._supervisor.log(Level.OK, text)
