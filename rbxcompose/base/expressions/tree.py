"""A parsed expression: a tree of frozen nodes, each with its place in the text."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from typing import Any, TypeAlias

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.units import Dimension


class ExpressionError(ValueError):
    """Raised when a text is no expression; `start` and `end` are offsets in it, `help` may be empty."""

    def __init__(self, message: str, start: int, end: int, help: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.start = start
        self.end = end
        self.help = help


@dataclass(frozen=True, slots=True)
class _Placed:
    """Something at `start` to `end` (exclusive) of the text."""

    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Number(_Placed):
    """`0.3 m/s`: a value in SI with its dimension."""

    value: float
    dimension: Dimension


@dataclass(frozen=True, slots=True)
class Text(_Placed):
    """`'hello'`, without its quotes."""

    value: str


@dataclass(frozen=True, slots=True)
class Flag(_Placed):
    """`true` or `false`."""

    value: bool


@dataclass(frozen=True, slots=True)
class Variable(_Placed):
    """`$name`, looked up while the robot runs."""

    name: str


@dataclass(frozen=True, slots=True)
class Word(_Placed):
    """A bare word, dots included: a place, a choice, a result, `args.speed`."""

    name: str


@dataclass(frozen=True, slots=True)
class Items(_Placed):
    """`[a, b]`: a list literal."""

    items: tuple[ExpressionNode, ...]


@dataclass(frozen=True, slots=True)
class FieldAccess(_Placed):
    """`of.name`: an entry of a map."""

    of: ExpressionNode
    name: str


@dataclass(frozen=True, slots=True)
class Index(_Placed):
    """`of[index]`: an entry of a list, counted from 0, or of a map."""

    of: ExpressionNode
    index: ExpressionNode


@dataclass(frozen=True, slots=True)
class FunctionCall(_Placed):
    """`function(arguments)`, one of the few existing functions."""

    function: str
    arguments: tuple[ExpressionNode, ...]


@dataclass(frozen=True, slots=True)
class Minus(_Placed):
    """`-operand`."""

    operand: ExpressionNode


@dataclass(frozen=True, slots=True)
class Not(_Placed):
    """`not operand`."""

    operand: ExpressionNode


@dataclass(frozen=True, slots=True)
class Arithmetic(_Placed):
    """`left + right`, and `-`, `*`, `/` alike."""

    operator: str
    left: ExpressionNode
    right: ExpressionNode


@dataclass(frozen=True, slots=True)
class Comparison(_Placed):
    """`left < right`, and `<=`, `>`, `>=`, `==`, `!=` alike."""

    operator: str
    left: ExpressionNode
    right: ExpressionNode


@dataclass(frozen=True, slots=True)
class Membership(_Placed):
    """`item in group`."""

    item: ExpressionNode
    group: ExpressionNode


@dataclass(frozen=True, slots=True)
class Junction(_Placed):
    """`a and b and c`, or the same with `or`: evaluated from the left until decided."""

    operator: str
    operands: tuple[ExpressionNode, ...]


ExpressionNode: TypeAlias = (
    Number
    | Text
    | Flag
    | Variable
    | Word
    | Items
    | FieldAccess
    | Index
    | FunctionCall
    | Minus
    | Not
    | Arithmetic
    | Comparison
    | Membership
    | Junction
)


def children(node: ExpressionNode) -> tuple[ExpressionNode, ...]:
    """Return the direct children of this node, in the order of the text."""
    match node:
        case Items(items=nodes) | FunctionCall(arguments=nodes) | Junction(operands=nodes):
            return nodes
        case FieldAccess(of=of):
            return (of,)
        case Index(of=first, index=second) | Membership(item=first, group=second):
            return (first, second)
        case Arithmetic(left=first, right=second) | Comparison(left=first, right=second):
            return (first, second)
        case Minus(operand=operand) | Not(operand=operand):
            return (operand,)
        case _:
            return ()


def walk(tree: ExpressionNode) -> Iterator[tuple[ExpressionNode, int]]:
    """Yield each node with its level (1 for the root), in the order of the text; it needs no recursion."""
    waiting = [(tree, 1)]
    while waiting:
        node, level = waiting.pop()
        yield node, level
        waiting.extend((child, level + 1) for child in reversed(children(node)))


@dataclass(frozen=True, slots=True)
class Reference:
    """A name that an expression uses, without its `$`, and its position."""

    name: str
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Expression:
    """A parsed text; two are equal if they mean the same at the same positions."""

    text: str
    tree: ExpressionNode
    names: tuple[Reference, ...] = field(init=False, compare=False, repr=False)
    """`$names`: for `$data.field[0]` it is `data`."""
    words: tuple[Reference, ...] = field(init=False, compare=False, repr=False)
    """Bare words, with their dots."""
    calls: tuple[Reference, ...] = field(init=False, compare=False, repr=False)
    """Functions."""
    made: dict[str, Any] = field(init=False, compare=False, repr=False, default_factory=dict)
    """What was made of the tree, to compute it faster."""

    def __post_init__(self) -> None:
        nodes = [node for node, _ in walk(self.tree)]
        for name, found in {
            "names": [Reference(node.name, node.start, node.end) for node in nodes if isinstance(node, Variable)],
            "words": [Reference(node.name, node.start, node.end) for node in nodes if isinstance(node, Word)],
            "calls": [
                Reference(node.function, node.start, node.start + len(node.function))
                for node in nodes
                if isinstance(node, FunctionCall)
            ],
        }.items():
            object.__setattr__(self, name, tuple(found))


def new_names(expression: Expression) -> frozenset[str]:
    """Return the names that an expression passes to `new($x)`."""
    if not any(call.name == "new" for call in expression.calls):
        return frozenset()
    calls = (node for node, _ in walk(expression.tree) if isinstance(node, FunctionCall) and node.function == "new")
    return frozenset(argument.name for call in calls for argument in call.arguments if isinstance(argument, Variable))
