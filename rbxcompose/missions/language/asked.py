"""The contents of a node as written: expressions with their types, assignments, arguments."""

from __future__ import annotations

from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.tree import Expression
from rbxcompose.expressions.types import Type
from rbxcompose.findings import Span
from rbxcompose.manifest.tree import ScalarNode, TreeNode


@dataclass(frozen=True, slots=True)
class Asked:
    """An expression of a node, the type that its value must have, and the scalar that contains it.

    If its value is assigned, it must have the type of the datum. A watched condition is evaluated again and again while
    its node runs; all else is evaluated once.
    """

    expression: Expression
    wanted: Type
    scalar: ScalarNode
    is_assigned: bool = False
    is_watched: bool = False


@dataclass(frozen=True, slots=True)
class Assignment:
    """A name that is set, its place, and the expression for its new value."""

    name: str
    span: Span
    asked: Asked


@dataclass(frozen=True, slots=True)
class WrittenArgument:
    """An argument of a skill or a mission as written; its type depends on these. The main one has no name."""

    name: str
    value: TreeNode
    span: Span
