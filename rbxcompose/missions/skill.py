"""Running a skill: its arguments are computed, the world is asked, and the result comes later."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from rbxcompose.expressions.evaluate import evaluate
from rbxcompose.expressions.text import parse_template
from rbxcompose.expressions.types import Type, TypeKind
from rbxcompose.expressions.values import Place, Value
from rbxcompose.manifest.tree import Node as Located
from rbxcompose.manifest.tree import Scalar
from rbxcompose.missions.events import SkillEnded, SkillStarted
from rbxcompose.missions.literals import literal
from rbxcompose.missions.program import Argument, Skill
from rbxcompose.missions.spans import expression_of
from rbxcompose.missions.statuses import IDLE, NAMES, RUNNING
from rbxcompose.missions.task import NodeFailed, Site, Task

Getter = Callable[["SkillTask"], Value]
PLACED = (TypeKind.PLACE, TypeKind.POSE)


class SkillTask(Task):
    """A leaf that asks something of the robot and waits for its result."""

    __slots__ = ("arguments", "getters", "is_asked", "result", "skill", "started")

    def __init__(self, site: Site, skill: Skill, arguments: tuple[Argument, ...]) -> None:
        super().__init__(site)
        self.skill = skill
        names = [(argument.name or skill.main, argument.value) for argument in arguments]
        self.getters: Mapping[str, Getter] = {name: getter(value, skill.arguments[name]) for name, value in names}
        self.arguments: dict[str, Value] = {}
        self.is_asked = False  # the world is at it, and has not told how it ended
        self.result = IDLE
        self.started = 0.0  # [s] of robot time

    def begin(self) -> int:
        """Compute the arguments and ask."""
        self.arguments = {name: get(self) for name, get in self.getters.items()}
        return self.ask()

    def proceed(self) -> int:
        """Return the result, once there is one."""
        if self.is_asked:
            return RUNNING
        if self.result == RUNNING:
            return self.ask()
        return self.result

    def ask(self) -> int:
        """Start the skill; it is asked again after a pause."""
        self.started, self.result, self.is_asked = self.engine.now, RUNNING, True
        self.engine.say(SkillStarted(self.number, self.skill.name, self.arguments))
        try:
            self.engine.world.start(self.number, self.skill.name, self.arguments)
        except Exception:
            self.is_asked = False
            raise
        return RUNNING

    def ended(self, result: int, message: str) -> None:
        """Take the result from the world."""
        self.is_asked = False
        self.result = result
        self.say_ended(NAMES[result], message)

    def halt(self) -> None:
        """Ask the world to stop it."""
        super().halt()
        self.stop()

    def suspend(self, anew: bool) -> bool:
        """Ask the world to stop it, to be started or asked again; a result that has come already stays."""
        if not self.is_asked:
            return False
        self.stop()
        self.statuses[self.number] = IDLE
        self.engine.cut_short.append(self.number)
        return anew

    def stop(self) -> None:
        """Stop what the world is at."""
        if self.is_asked:
            self.is_asked = False
            self.engine.forget_result(self.number)
            self.say_ended("halted", self.engine.because)
            self.engine.world.halt(self.number)

    def say_ended(self, result: str, message: str) -> None:
        """Say how it ended, and how long it took."""
        self.engine.say(SkillEnded(self.number, self.skill.name, result, self.engine.now - self.started, message))


def getter(value: Located, wanted: Type) -> Getter:
    """Return what computes an argument of the type `wanted` from what was written."""
    if not isinstance(value, Scalar):
        constant = literal(value).value
        return lambda task: constant
    if wanted.kind is TypeKind.TEXT:
        template = parse_template(value.text)
        return lambda task: task.engine.filled(template, task.scope)
    expression = expression_of(value)
    if wanted.kind in PLACED:
        return lambda task: _place(task, evaluate(expression, task.scope))
    if wanted.kind is TypeKind.CHOICE:
        return lambda task: _word(evaluate(expression, task.scope))
    return lambda task: evaluate(expression, task.scope)


def _place(task: SkillTask, value: Value) -> Value:
    """Return the place that a text names; a place or a pose as it is."""
    found = task.engine.places.get(value, value) if isinstance(value, str) else value
    if isinstance(found, str):
        raise NodeFailed(f"there is no place '{found}'")
    return found


def _word(value: Value) -> Value:
    """Return a choice as text, also where a place has the same name."""
    return value.name if isinstance(value, Place) else value
