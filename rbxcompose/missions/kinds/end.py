"""`end`: the mission is over."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rbxcompose.expressions.text import Template
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import FAILURE, NAMES, RUNNING, SUCCESS
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader


@dataclass(frozen=True, slots=True)
class EndOptions:
    """How the mission ends, and what is told."""

    result: str
    message: Template | None


@kind("end", {"message": "What is told about it."})
class End(Task):
    """End the mission in which this is written, in `success` or in `failure`; what runs is halted.

    Where two branches of a parallel end it at one tick, failure beats success.

    Example:
        do:
          if: $battery < 10 %
          then:
            end: failure
            message: The battery has only $battery
          else:
            go_to: corner_1
    """

    __slots__ = ("options",)

    def __init__(self, site: Site, options: EndOptions) -> None:
        super().__init__(site)
        self.options = options

    @staticmethod
    def read(reader: NodeReader) -> EndOptions:
        """Read the result and `message`."""
        result = reader.choice(reader.key, (NAMES[SUCCESS], NAMES[FAILURE]))
        return EndOptions(result, reader.template("message") if reader.has("message") else None)

    def begin(self) -> int:
        """End it; the run of the mission sees to that as soon as this tick is done."""
        message = self.run.filled(self.options.message, self.scope) if self.options.message else ""
        status = SUCCESS if self.options.result == NAMES[SUCCESS] else FAILURE
        if self.run.ending is None or (status, self.run.ending) == (FAILURE, SUCCESS):
            self.run.ending, self.run.message = status, message
            if status == FAILURE:
                self.engine.reasons[self.number] = message or "the mission was to end in failure"
        return RUNNING
