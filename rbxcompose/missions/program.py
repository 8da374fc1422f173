"""A mission that was read: a flat, frozen tuple of nodes, and what stands beside them in its file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from rbxcompose.config import Place
from rbxcompose.expressions.text import parse_template
from rbxcompose.expressions.tree import Expression
from rbxcompose.expressions.types import Type
from rbxcompose.expressions.values import Value
from rbxcompose.findings import Span
from rbxcompose.manifest.tree import Mapping as LocatedMapping
from rbxcompose.manifest.tree import Node as Located
from rbxcompose.manifest.tree import Scalar

ROOT = 0  # number of the node under `do`
RATE = 20.0  # [Hz] of conditions that nothing announces


@dataclass(frozen=True, slots=True)
class Skill:
    """What a mission may ask of the robot: typed arguments in order, and the `main` one that a single value is."""

    name: str
    arguments: Mapping[str, Type] = field(default_factory=dict)
    main: str = ""
    required: frozenset[str] = frozenset()
    claims: str = ""
    restartable: bool = True


@dataclass(frozen=True, slots=True)
class RobotNames:
    """What the robot gives to every mission: types of its values, its places, its skills, all by name.

    It is not complete if a part of the robot has mistakes: then a skill that is missing may be that part's.
    """

    values: Mapping[str, Type] = field(default_factory=dict)
    places: Mapping[str, Place] = field(default_factory=dict)
    skills: Mapping[str, Skill] = field(default_factory=dict)
    is_complete: bool = True


@dataclass(frozen=True, slots=True)
class Datum:
    """A value that was written down: in SI, with its type and place."""

    value: Value
    type: Type
    span: Span


@dataclass(frozen=True, slots=True)
class Input:
    """A typed argument of a mission; without a default it must be given."""

    name: str
    type: Type
    span: Span
    default: Datum | None = None
    least: float | None = None
    most: float | None = None


@dataclass(frozen=True, slots=True)
class Asked:
    """An expression of a node, the type that its value must have, and the scalar that it stands in."""

    expression: Expression
    wanted: Type
    scalar: Scalar


@dataclass(frozen=True, slots=True)
class Assignment:
    """A name that is set, its place, and the expression for its new value."""

    name: str
    span: Span
    asked: Asked


@dataclass(frozen=True, slots=True)
class Argument:
    """An argument of a skill as written; what it means depends on the skill. The main one has no name."""

    name: str
    value: Located
    span: Span


@dataclass(frozen=True, slots=True)
class Node:
    """One mission node. Those below it have the numbers from `number + 1` to `end` (exclusive).

    `kind` is the word of the language, or empty for a skill, whose name is then `skill`. `options` is what the kind's
    own `read` returned, or the arguments of a skill; `modifiers` are by key; `asked` are all expressions, for
    checking. `item` is the name that a loop gives to its item.
    """

    number: int
    kind: str
    name: str
    path: str
    span: Span
    parent: int | None
    children: tuple[int, ...]
    end: int
    options: object
    modifiers: Mapping[str, object] = field(default_factory=dict)
    asked: tuple[Asked, ...] = ()
    item: str = ""
    skill: str = ""

    @property
    def arguments(self) -> tuple[Argument, ...]:
        """Return the arguments of a skill as written; other kinds have none."""
        written = self.options if self.skill and isinstance(self.options, tuple) else ()
        return tuple(argument for argument in written if isinstance(argument, Argument))


@dataclass(frozen=True, slots=True)
class Interrupt:
    """A condition that cuts the mission short, and the node that is done then (None: nothing)."""

    name: str
    when: Asked
    root: int | None
    afterwards: str
    span: Span


@dataclass(frozen=True, slots=True)
class Program:
    """A mission: the node under `do` has the number 0; those of the interrupts follow.

    `root` is what it was read from; the rest follows from it.
    """

    name: str
    about: str
    file: str
    nodes: tuple[Node, ...]
    inputs: Mapping[str, Input] = field(default_factory=dict)
    data: Mapping[str, Datum] = field(default_factory=dict)
    interrupts: tuple[Interrupt, ...] = ()
    rate: float = RATE
    root: LocatedMapping = field(default_factory=LocatedMapping, repr=False)

    def asked(self) -> Iterator[tuple[Node | None, Asked]]:
        """Yield all expressions, with the node that asks; None for an interrupt."""
        for node in self.nodes:
            for asked in node.asked:
                yield node, asked
        for interrupt in self.interrupts:
            yield None, interrupt.when

    def below(self, number: int) -> tuple[Node, ...]:
        """Return a node and all below it."""
        return self.nodes[number : self.nodes[number].end]

    def reads(self) -> frozenset[str]:
        """Return all `$names` that are read anywhere, arguments of skills included."""
        read = {name.name for _, asked in self.asked() for name in asked.expression.names}
        arguments = (one for node in self.nodes if node.skill for one in node.arguments)
        written = (argument.value.text for argument in arguments if isinstance(argument.value, Scalar))
        return frozenset(read.union(name.name for text in written for name in parse_template(text).names))
