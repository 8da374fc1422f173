"""`repeat`: the same again, a number of times or for ever."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rbxcompose.expressions.evaluate import holds
from rbxcompose.expressions.tree import Expression, Number
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import FAILURE, RUNNING, SKIPPED, SUCCESS
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader
    from rbxcompose.missions.program import Node


@dataclass(frozen=True, slots=True)
class RepeatOptions:
    """How many rounds (None: for ever), the condition that ends them, the time from start to start."""

    rounds: Expression | None
    until: Expression | None
    every: Expression | None


@kind(
    "repeat",
    {
        "do": "What is done in each round.",
        "until": "A condition that ends the loop; it is asked after each round and never cuts one.",
        "every": "Time from the start of one round to the start of the next.",
    },
)
class Repeat(Task):
    """Do the body again and again; a round that fails fails it, a number that is used up succeeds.

    Example:
        do:
          repeat: 3
          every: 1 min
          until: $battery < 40 %
          do:
            go_to: corner_1
    """

    __slots__ = ("body", "did", "due", "is_between", "left", "options", "period")
    saved = ("did", "due", "is_between", "left", "period")

    def __init__(self, site: Site, options: RepeatOptions) -> None:
        super().__init__(site)
        self.body = site.children[0]
        self.options = options
        self.left = math.inf
        self.period = 0.0
        self.due = 0.0  # when the next round may start [s]
        self.is_between = False  # one round has ended and the next one has not started
        self.did = SKIPPED

    @staticmethod
    def read(reader: NodeReader) -> RepeatOptions:
        """Read the number of rounds, `do`, `until` and `every`."""
        rounds = reader.count_or_forever(reader.key)
        reader.child("do")
        until = reader.condition("until") if reader.has("until") else None
        return RepeatOptions(rounds, until, reader.duration("every") if reader.has("every") else None)

    @staticmethod
    def waits(node: Node) -> bool:
        """It waits between its rounds if they have a period."""
        every = node.options.every if isinstance(node.options, RepeatOptions) else None
        return every is not None and not (isinstance(every.tree, Number) and every.tree.value == 0)

    def begin(self) -> int:
        """Start the first round, or the one in which it was halted."""
        if self.engine.places.kept and self.engine.places.take_up(self):
            self.due = self.engine.time if self.is_between else self.engine.time + self.period
            return self.proceed()
        rounds, every = self.options.rounds, self.options.every
        self.left = math.inf if rounds is None else self.count_of(rounds, "'repeat'")
        self.period = 0.0 if every is None else self.number_of(every, "'every'")
        if self.left < 1:
            return SKIPPED
        self.did = SKIPPED
        self.is_between = True
        self.due = self.engine.time
        return self.proceed()

    def proceed(self) -> int:
        """Go on with this round; the next one is for another tick."""
        if self.is_between:
            if not self.engine.is_due(self.due):
                return RUNNING
            self.is_between = False
            self.due = self.engine.time + self.period
            self.forget()
        status = self.advance(self.body)
        if status == RUNNING:
            return RUNNING
        self.engine.outcome = ""
        if status == FAILURE:
            return FAILURE
        if status == SUCCESS:
            self.did = SUCCESS
        self.left -= 1
        until = self.options.until
        if self.left < 1 or (until is not None and holds(until, self.scope)):
            return self.did
        self.is_between = True
        if self.engine.is_due(self.due):
            self.engine.again(self)
        return RUNNING
