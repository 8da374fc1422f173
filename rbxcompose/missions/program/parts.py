"""The parts of a mission: what is written in its nodes, and in which types kinds and modifiers answer questions."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from dataclasses import field
from enum import Enum, StrEnum, auto
from typing import NamedTuple, TypeAlias

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.parser import parse
from rbxcompose.base.expressions.text import Template
from rbxcompose.base.expressions.tree import Expression, Flag, Number, Text, Word
from rbxcompose.base.expressions.types import Type
from rbxcompose.base.expressions.values import Value
from rbxcompose.base.findings import Span
from rbxcompose.base.units import NUMBER, Quantity
from rbxcompose.manifest.tree import ScalarNode, TreeNode
from rbxcompose.missions.language.grammar import NO_HISTORY
from rbxcompose.missions.program.outcomes import FAILURE, NAMES, SKIPPED, SUCCESS


def inner_span(scalar: ScalarNode, start: int, end: int) -> Span:
    """Return the place of the characters `start` to `end` of a scalar.

    If the text in the file differs (folded lines, escapes, filled-in values), it is the whole scalar.
    """
    span = scalar.span
    quotes = 0 if scalar.plain else 1
    if span.line != span.end_line or span.end_column - span.column != len(scalar.text) + 2 * quotes:
        return span
    first = span.column + quotes + start
    return span._replace(column=first, end_column=max(first + 1, span.column + quotes + end))


def expression_of(scalar: ScalarNode) -> Expression:
    """Return the expression in a scalar; one filled in by `${...}` is a value already.

    Raises:
        ExpressionError: if it is no expression.
    """
    end = len(scalar.text)
    match scalar.filled:
        case None:
            # Quotes round a whole word are intended: people write 'hello' for a text, and YAML removes the quotes.
            expression = parse(scalar.text)
            if not scalar.plain and isinstance(expression.tree, Word):
                return Expression(scalar.text, Text(0, len(scalar.text), expression.tree.name))
            return expression
        case Quantity(value=value, dimension=dimension):
            return Expression(scalar.text, Number(0, end, value, dimension))
        case bool() as flag:
            return Expression(scalar.text, Flag(0, end, flag))
        case int() | float() as number:
            return Expression(scalar.text, Number(0, end, float(number), NUMBER))
        case text:
            return Expression(scalar.text, Text(0, end, str(text)))


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


@dataclass(frozen=True, slots=True)
class Datum:
    """A value as written: in SI, with its type and span."""

    value: Value
    type: Type
    span: Span


@dataclass(frozen=True, slots=True)
class Input:
    """A typed argument of a mission; without a default it must be given.

    With mistakes in its declaration it is not sound: it may have a default that could not be read.
    """

    name: str
    type: Type
    span: Span
    default: Datum | None = None
    least: float | None = None
    most: float | None = None
    is_sound: bool = True

    @property
    def must_be_given(self) -> bool:
        """Return whether it has no value unless one is given."""
        return self.default is None and self.is_sound


FINISHED, FAILED = "finished", "failed"
ENDS: Mapping[str, str] = {FINISHED: NAMES[SUCCESS], FAILED: NAMES[FAILURE]}  # those that always exist
STATE = "state"
MACHINE_KEYS = ("start", "states", "ends", "history")


@dataclass(frozen=True, slots=True)
class Next:
    """Where a state leads to, by outcome; the empty outcome covers all that are not named."""

    to: Mapping[str, str] = field(default_factory=dict)
    spans: Mapping[str, Span] = field(default_factory=dict)  # of the names of these states, by outcome
    keys: Mapping[str, Span] = field(default_factory=dict)  # of the outcomes

    def key_for(self, outcome: str, counts_as: str) -> str | None:
        """Return the key of the transition that an outcome takes: its own, or that of what it counts as."""
        for key in (outcome, counts_as, ""):
            if key in self.to:
                return key
        return None


@dataclass(frozen=True, slots=True)
class MachineStates:
    """The first state, the names of the states in the order of the children, the ends with their results."""

    start: str = ""
    names: tuple[str, ...] = ()
    ends: Mapping[str, str] = field(default_factory=dict)
    start_span: Span | None = None
    history: str = NO_HISTORY


@dataclass(frozen=True, slots=True)
class WrittenValue:
    """One value as written: a text with slots, and an expression if it can be parsed as one."""

    scalar: ScalarNode
    template: Template
    expression: Expression | None


TemplateShape: TypeAlias = "WrittenValue | Mapping[str, TemplateShape] | tuple[TemplateShape, ...]"


@dataclass(frozen=True, slots=True)
class MessageTemplate:
    """What is sent, and where; `body` is None for a message whose fields all keep their zero values.

    `keys` are the spans of the field names, by the path to each.
    """

    target: ScalarNode
    body: TemplateShape | None
    keys: Mapping[tuple[str, ...], Span] = field(default_factory=dict)

    @property
    def names(self) -> frozenset[str]:
        """Return all `$names` that it reads."""
        return frozenset(_names(self.body))


def _names(shape: TemplateShape | None) -> Iterator[str]:
    match shape:
        case WrittenValue():
            yield from (name.name for name in shape.template.names)
        case Mapping():
            for inner in shape.values():
                yield from _names(inner)
        case tuple():
            for inner in shape:
                yield from _names(inner)


ALL, ANY = "all", "any"
OTHERWISE, HALTED = "otherwise", "halted"
CONDITIONAL = frozenset(("if", "then", "else", "when", "check", "choose", "cases"))
"""Words of conditions, which are no outcomes."""
RESULTS = (NAMES[SUCCESS], NAMES[FAILURE], NAMES[SKIPPED], HALTED)


@dataclass(frozen=True, slots=True)
class OutcomeRule:
    """An outcome and its condition over the branches, None for `otherwise`."""

    name: str
    condition: Expression | None
    asked: Asked | None


@dataclass(frozen=True, slots=True)
class Branches:
    """What decides how parallel nodes end: `all` of them, `any`, a number of them, or one branch.

    `names` are the names of the branches, if they have any, in the order of the children.
    """

    names: tuple[str, ...] = ()
    succeed_when: Expression | str = ALL
    fail_when: Expression | str = ANY
    ends_with: str = ""
    ends_at: Span | None = None  # where `ends_with` names its branch
    outcomes: tuple[OutcomeRule, ...] = ()

    def deciding(self, children: tuple[int, ...]) -> tuple[int, ...]:
        """Return the children whose results count."""
        return (children[self.names.index(self.ends_with)],) if self.ends_with in self.names else children


@dataclass(frozen=True, slots=True)
class BranchChoice:
    """The expression to choose by, and the value of each case, in the order of the children."""

    asked: Expression
    cases: tuple[Asked, ...] = ()


LEVELS = ("info", "warn", "error")  # of a log
DEEDS = ("set", "log", "publish")
OPTIONS = {"level": "log", "message": "publish"}  # each with the action that it belongs to


@dataclass(frozen=True, slots=True)
class Deeds:
    """The actions at one moment; all right-hand sides are evaluated before anything is set."""

    assignments: tuple[Assignment, ...] = ()
    text: Template | None = None
    level: str = "info"
    message: MessageTemplate | None = None


@dataclass(frozen=True, slots=True)
class Moments:
    """Actions by the key of their moment."""

    deeds: Mapping[str, Deeds] = field(default_factory=dict)

    @property
    def names(self) -> frozenset[str]:
        """Return all `$names` that their messages read."""
        return frozenset[str]().union(*(entry.message.names for entry in self.deeds.values() if entry.message))


@dataclass(frozen=True, slots=True)
class WrittenSetting:
    """A setting of a component that is changed, as written."""

    component: ScalarNode
    parameter: ScalarNode

    @property
    def path(self) -> str:
        """Return its name: `battery.runtime`."""
        return f"{self.component.text}.{self.parameter.text}"

    @property
    def service(self) -> str:
        """Return the service of the component that changes it."""
        return f"{self.component.text}/change_parameters"


@dataclass(frozen=True, slots=True)
class NodeEffects:
    """What a node does to the mission and the robot by itself: what it sets, publishes and calls.

    `shortened` is the name of the data that it removes items from: empty if it should but names none, None if it does
    not.
    """

    assignments: tuple[Assignment, ...] = ()
    published: MessageTemplate | None = None
    called: MessageTemplate | None = None
    setting: WrittenSetting | None = None
    shortened: str | None = None


NO_EFFECTS = NodeEffects()


StateKey: TypeAlias = tuple[Hashable, ...]


class Possibility(NamedTuple):
    """Something that a node may do: its span, its description, and its key."""

    span: Span
    text: str
    key: StateKey


def started(number: int) -> StateKey:
    """Return the key of the start of a node."""
    return ("node", number)


def skipped(number: int) -> StateKey:
    """Return the key of a node that ends skipped."""
    return ("skipped", number)


def ended(leaf: int, outcome: str) -> StateKey:
    """Return the key of a skill that ends with an outcome."""
    return ("skill", leaf, outcome)


def led(machine: int, state: str, to: str, outcome: str = "") -> StateKey:
    """Return the key of a transition; without an outcome, of one on any outcome."""
    return ("transition", machine, state, to, *([outcome] if outcome else []))


def cut(interrupt: str) -> StateKey:
    """Return the key of an interrupt that acts."""
    return ("interrupt", interrupt)


class Form(StrEnum):
    """How the children of a node are arranged: one after the other, side by side, or as states with transitions.

    `STATE` is for a state itself.
    """

    AFTER = "after"
    BESIDE = "beside"
    MACHINE = "machine"
    STATE = "state"


@dataclass(frozen=True, slots=True)
class NodeLook:
    """The sign before the title, the form, and whether the keys of the children are worth showing."""

    sign: str = ""
    form: Form = Form.AFTER
    has_roles: bool = False


PLAIN = NodeLook()


class Advice(NamedTuple):
    """What is wrong, and what to do about it."""

    message: str
    help: str


class Counted(NamedTuple):
    """A number in a node: what it is called, its expression, the least value that makes sense, what less does."""

    what: str
    expression: Expression | None
    least: float
    effect: str = ""


class NodeFlow(Enum):
    """How a node goes through its children when all goes well."""

    IN_TURN = auto()
    PER_ITEM = auto()  # once for each item of a list
    FIRST = auto()  # through the first; the others are for its failures
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
