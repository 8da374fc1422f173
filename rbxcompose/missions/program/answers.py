"""The words in which kinds of nodes and modifiers answer questions about them before a mission runs."""

from __future__ import annotations

from enum import Enum, auto
from typing import NamedTuple

from rbxcompose.expressions.tree import Expression


class Advice(NamedTuple):
    """What is wrong, and what to do about it."""

    message: str
    help: str


class Counted(NamedTuple):
    """A number of a node, what it is called, and the least that has a meaning."""

    what: str
    expression: Expression | None
    least: float


class NodeFlow(Enum):
    """How a node goes through those inside it when all goes well."""

    IN_TURN = auto()
    PER_ITEM = auto()  # once for each item of a list
    ONE_OF = auto()  # through one of them
    OPEN = auto()  # what of them is done, and when, is not written down


class Skipped(Enum):
    """When a node does nothing, and is skipped itself."""

    NEVER = auto()
    WITH_ALL_INSIDE = auto()  # if all that it does is skipped
    PERHAPS = auto()


class ModifierScope(Enum):
    """For which nodes a modifier is there."""

    ALL = auto()
    FAILING = auto()  # that may fail
    REPEATED = auto()  # that are done more than once
