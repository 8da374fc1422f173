"""Running a skill: its arguments are computed, the world is asked, and the result comes later."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from rbxcompose.expressions.evaluate import evaluate
from rbxcompose.expressions.text import parse_template
from rbxcompose.expressions.types import Type, TypeKind
from rbxcompose.expressions.values import Place, Value
from rbxcompose.manifest.tree import Node as Located
from rbxcompose.manifest.tree import Scalar
from rbxcompose.missions.events import Reported, SkillEnded, SkillStarted
from rbxcompose.missions.leaf import Leaf
from rbxcompose.missions.literals import literal
from rbxcompose.missions.program import Argument, Skill
from rbxcompose.missions.results import Result
from rbxcompose.missions.spans import expression_of
from rbxcompose.missions.statuses import FAILURE, NAMES, RUNNING, SUCCESS
from rbxcompose.missions.task import NodeFailed, Site, Task

Getter = Callable[[Task], Value]
SUCCESS_WORD, FAILURE_WORD = NAMES[SUCCESS], NAMES[FAILURE]  # what an outcome counts as
PLACED = (TypeKind.PLACE, TypeKind.POSE)


class SkillTask(Leaf):
    """A leaf that asks a skill of the robot."""

    __slots__ = ("arguments", "getters", "skill", "started")
    saved = (*Leaf.saved, "arguments", "started")

    def __init__(self, site: Site, skill: Skill, arguments: tuple[Argument, ...]) -> None:
        super().__init__(site)
        self.skill = skill
        names = [(argument.name or skill.main, argument.value) for argument in arguments]
        self.getters: Mapping[str, Getter] = {name: getter(value, skill.arguments[name]) for name, value in names}
        self.arguments: dict[str, Value] = {}
        self.started = 0.0  # [s] of robot time

    def begin(self) -> int:
        """Compute the arguments and ask."""
        self.arguments = {name: get(self) for name, get in self.getters.items()}
        return self.ask()

    def ask(self) -> int:
        """Start the skill; it is asked again after a pause."""
        self.started, self.status = self.engine.now, RUNNING
        self.engine.say(SkillStarted(self.number, self.skill.name, self.arguments))
        self.is_asked = True
        try:
            self.engine.world.start(self.number, self.skill.name, self.arguments)
        except Exception:
            self.is_asked = False
            raise
        return RUNNING

    def ended(self, result: Result) -> None:
        """Take the result from the world."""
        super().ended(result)
        message = self.engine.reasons[self.number] if self.status == FAILURE else result.message
        self.say_ended(self.outcome or NAMES[self.status], message)

    def judged(self, result: Result) -> tuple[int, str, str]:
        """Return what the outcome counts as; one that the skill did not declare is a failure."""
        outcome = result.outcome
        if outcome in ("", SUCCESS_WORD, FAILURE_WORD):
            return super().judged(result)
        if outcome not in self.skill.outcomes:
            message = f"the skill '{self.skill.name}' ended with an outcome that it does not declare: '{outcome}'"
            self.engine.say(Reported(self.engine.program.nodes[self.number].path, message))
            return FAILURE, "", message
        status = SUCCESS if self.skill.outcomes[outcome] == SUCCESS_WORD else FAILURE
        return status, outcome, result.message or outcome

    def suspend(self, anew: bool) -> bool:
        """Hold the skill if it can pause and is to go on, else stop it."""
        if self.is_asked and self.skill.pausable and not self._begins_anew():
            if not self.is_held:
                self.is_held = True
                self.engine.world.pause(self.number)
            return False
        return super().suspend(anew)

    def _begins_anew(self) -> bool:
        nodes = self.engine.program.nodes
        return any(one.number <= self.number < nodes[one.number].end for one in self.engine.restarting)

    def stop(self) -> None:
        """Stop what the world is at."""
        if self.is_asked:
            self.say_ended("halted", self.engine.because)
        super().stop()

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
        return lambda task: task.run.filled(template, task.scope)
    expression = expression_of(value)
    if wanted.kind in PLACED:
        return lambda task: place(task, evaluate(expression, task.scope))
    if wanted.kind is TypeKind.CHOICE:
        return lambda task: _word(evaluate(expression, task.scope))
    return lambda task: evaluate(expression, task.scope)


def place(task: Task, value: Value) -> Value:
    """Return the place that a text names; a place or a pose as it is."""
    found = task.engine.robot.places.get(value, value) if isinstance(value, str) else value
    if isinstance(found, str):
        raise NodeFailed(f"there is no place '{found}'")
    return found


def _word(value: Value) -> Value:
    """Return a choice as text, also where a place has the same name."""
    return value.name if isinstance(value, Place) else value
