"""What hooks do at moments of a node: set data, log, publish. It takes no time and changes no result but by failing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rbxcompose.expressions.evaluate import evaluate
from rbxcompose.expressions.text import Template
from rbxcompose.missions.events import Logged, Published
from rbxcompose.missions.messages import Message
from rbxcompose.missions.program import Assignment
from rbxcompose.msgs import registry

if TYPE_CHECKING:
    from rbxcompose.missions.task import Task

LEVELS = ("info", "warn", "error")  # of a log
DEEDS = ("set", "log", "publish")
OPTIONS = {"level": "log", "message": "publish"}  # each with the deed that it belongs to


@dataclass(frozen=True, slots=True)
class Deeds:
    """What is done at one moment; all right sides are computed before anything is set."""

    assignments: tuple[Assignment, ...] = ()
    text: Template | None = None
    level: str = "info"
    message: Message | None = None

    def do(self, task: Task) -> None:
        """Do it; raises what its expressions raise."""
        if self.assignments:
            computed = {one.name: evaluate(one.asked.expression, task.scope) for one in self.assignments}
            task.run.data.update(computed)
            task.engine.again(task)
        if self.text:
            task.engine.say(Logged(self.level, task.run.filled(self.text, task.scope)))
        if self.message:
            publish(self.message, task)


@dataclass(frozen=True, slots=True)
class Moments:
    """Deeds by the key of their moment."""

    deeds: Mapping[str, Deeds] = field(default_factory=dict)

    @property
    def names(self) -> frozenset[str]:
        """Return all `$names` that their messages read."""
        return frozenset[str]().union(*(one.message.names for one in self.deeds.values() if one.message))

    def act(self, moment: str, task: Task) -> None:
        """Do what belongs to a moment; raises what its expressions raise, which fails the node."""
        if moment in self.deeds:
            outcome = task.engine.outcome
            self.deeds[moment].do(task)
            task.engine.outcome = outcome

    def act_safely(self, moment: str, task: Task) -> None:
        """Do what belongs to a moment at which nothing can fail any more; what goes wrong is reported."""
        try:
            self.act(moment, task)
        except Exception as error:  # the node is halted anyway
            task.engine.failed(task, error)


def publish(message: Message, task: Task) -> None:
    """Publish a message; raises what its expressions raise, and ValueError if a field does not fit."""
    topic = message.target.text
    fields = message.fields(registry.message(task.engine.robot.topics[topic]), task)
    task.engine.world.publish(topic, fields)
    task.engine.say(Published(task.number, topic, fields))
