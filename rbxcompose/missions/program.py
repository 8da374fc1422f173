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
    """What a mission may ask of the robot: typed arguments in order, and the `main` one that a single value is.

    `outcomes` are those beyond `success` and `failure`, each with which of the two it counts as. `claims` is what it
    needs for itself (base, arm, head, voice), empty for nothing. `results` are the types of what it tells at its end.
    """

    name: str
    arguments: Mapping[str, Type] = field(default_factory=dict)
    main: str = ""
    required: frozenset[str] = frozenset()
    claims: str = ""
    restartable: bool = True
    pausable: bool = False
    outcomes: Mapping[str, str] = field(default_factory=dict)
    results: Mapping[str, Type] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class RobotNames:
    """What the robot gives to every mission: types of its values, its places, its skills, its missions, all by name.

    `topics` and `services` have the ROS names of their types; `unread` are missions whose files could not be read;
    `removed` are places that a layer has taken away, each with where it did so.
    It is not complete if a part of the robot has mistakes: then a skill that is missing may be that part's.
    """

    values: Mapping[str, Type] = field(default_factory=dict)
    places: Mapping[str, Place] = field(default_factory=dict)
    skills: Mapping[str, Skill] = field(default_factory=dict)
    missions: Mapping[str, Program] = field(default_factory=dict)
    topics: Mapping[str, str] = field(default_factory=dict)
    services: Mapping[str, str] = field(default_factory=dict)
    unread: frozenset[str] = frozenset()
    removed: Mapping[str, Span] = field(default_factory=dict)
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
    """An expression of a node, the type that its value must have, and the scalar that it stands in.

    One that is assigned must have the type of its datum.
    """

    expression: Expression
    wanted: Type
    scalar: Scalar
    is_assigned: bool = False


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
    checking. `item` is the name that a loop gives to its item. `held` tells where a node that a `run` does stands in
    the data. `inner` is the mission that a `use` runs, in a program
    that was linked: its nodes are below this one.
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
    held: tuple[str, ...] = ()
    inner: Program | None = None

    @property
    def arguments(self) -> tuple[Argument, ...]:
        """Return the arguments of a skill as written; other kinds have none."""
        written = self.options if self.skill and isinstance(self.options, tuple) else ()
        return tuple(argument for argument in written if isinstance(argument, Argument))


CONTINUE, RESTART, END = "continue", "restart", "end"
AFTERWARDS = (CONTINUE, RESTART, END)  # the default first


@dataclass(frozen=True, slots=True)
class Target:
    """What an interrupt restarts: a node or state, or the current round of a loop."""

    number: int
    is_round: bool = False


@dataclass(frozen=True, slots=True)
class Interrupt:
    """A condition that cuts the mission short, and the node that is done then (None: nothing).

    `afterwards` is a word of `AFTERWARDS`; `targets` are all nodes that a restart by name may mean, of which those
    that run begin again.
    """

    name: str
    when: Asked
    root: int | None
    afterwards: str
    span: Span
    restarts: Scalar | None = None
    targets: tuple[Target, ...] = ()


@dataclass(frozen=True, slots=True)
class Program:
    """A mission: its main node has the number `main`, which is 0 unless it is part of a linked program.

    Those of the interrupts follow. `outputs` are what it gives to who uses it. `root` is what it was read from; the
    rest follows from it.
    """

    name: str
    about: str
    file: str
    nodes: tuple[Node, ...]
    inputs: Mapping[str, Input] = field(default_factory=dict)
    data: Mapping[str, Datum] = field(default_factory=dict)
    interrupts: tuple[Interrupt, ...] = ()
    rate: float = RATE
    outputs: Mapping[str, Asked] = field(default_factory=dict)
    main: int = ROOT
    root: LocatedMapping = field(default_factory=LocatedMapping, repr=False)

    def asked(self) -> Iterator[tuple[Node | None, Asked]]:
        """Yield all expressions, with the node that asks; None for an interrupt or an output."""
        for node in self.nodes:
            for asked in node.asked:
                yield node, asked
        for interrupt in self.interrupts:
            yield None, interrupt.when
        for asked in self.outputs.values():
            yield None, asked

    def below(self, number: int) -> tuple[Node, ...]:
        """Return a node and all below it."""
        return self.nodes[number : self.nodes[number].end]

    @property
    def saved(self) -> frozenset[str]:
        """Return the names under which results are kept."""
        names = (node.modifiers.get("save") for node in self.nodes)
        return frozenset(name.text for name in names if isinstance(name, Scalar))

    def reads(self) -> frozenset[str]:
        """Return all `$names` that are read anywhere, arguments of skills and of missions included."""
        read = {name.name for _, asked in self.asked() for name in asked.expression.names}
        options = (getattr(node.options, "arguments", node.arguments) for node in self.nodes)
        written = (one.value.text for arguments in options for one in arguments if isinstance(one.value, Scalar))
        for node in self.nodes:
            for part in (node.options, *node.modifiers.values()):
                read.update(getattr(part, "names", ()))  # of messages, hooks, outcomes, the order of a loop
        return frozenset(read.union(name.name for text in written for name in parse_template(text).names))
