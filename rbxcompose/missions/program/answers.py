"""Types in which kinds of nodes and modifiers answer questions about themselves before a mission runs."""

from __future__ import annotations

from enum import Enum, auto
from typing import NamedTuple

from rbxcompose.expressions.tree import Expression


class Advice(NamedTuple):
    """What is wrong, and what to do about it."""

    message: str
    help: str


class Counted(NamedTuple):
    """A number in a node: what it is called, its expression, and the least value that makes sense."""

    what: str
    expression: Expression | None
    least: float


class NodeFlow(Enum):
    """How a node goes through its children when all goes well."""

    IN_TURN = auto()
    PER_ITEM = auto()  # once for each item of a list
    ONE_OF = auto()  # through one of them
    OPEN = auto()  # the text does not say which of them run, and when


class Skipped(Enum):
    """When a node does nothing, and counts as skipped itself."""

    NEVER = auto()
    WITH_ALL_INSIDE = auto()  # if everything inside is skipped
    PERHAPS = auto()


class ModifierScope(Enum):
    """The nodes that a modifier is meant for."""

    ALL = auto()
    FAILING = auto()  # those that may fail
    REPEATED = auto()  # those that run more than once
