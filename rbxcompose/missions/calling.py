"""What is written down of a `use`, and what can be wrong with it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rbxcompose.findings import Span
from rbxcompose.missions.history import WithHistory
from rbxcompose.missions.program import Argument

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader


@dataclass(frozen=True, slots=True)
class UseOptions:
    """The mission that is run, what is given to it, and its history."""

    mission: str
    span: Span
    arguments: tuple[Argument, ...] = ()
    history: str = "none"


def read_use(reader: NodeReader) -> UseOptions:
    """Read the name of the mission, `with` and `history`."""
    name = reader.scalar(reader.key, "the name of a mission")
    given = reader.map_of("with", "a map from inputs to values") if reader.has("with") else None
    entries = given.entries.items() if given else ()
    arguments = tuple(Argument(key, entry.value, entry.key.span) for key, entry in entries)
    return UseOptions(
        name.text if name else "", name.span if name else reader.span, arguments, WithHistory.read_history(reader)
    )
