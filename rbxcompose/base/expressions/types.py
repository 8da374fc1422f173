"""Types of expressions, known without their values; and which type fits where."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from enum import Enum
from types import MappingProxyType

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.units import DIMENSIONS, NUMBER, Dimension


class TypeKind(Enum):
    """The kinds of types; the values name them in a sentence."""

    QUANTITY = "a quantity"
    COUNT = "a count"
    TEXT = "a text"
    FLAG = "a flag"
    PLACE = "a place"
    POSE = "a pose"
    CHOICE = "a choice"
    LIST = "a list"
    MAP = "a map"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Type:
    """The type of a value: a quantity has a dimension, a choice its words, a list or map the type of its entries."""

    kind: TypeKind
    dimension: Dimension | None = None
    choices: tuple[str, ...] = ()
    of: Type | None = None
    names: tuple[str, ...] = field(default=(), compare=False)
    """The only entries that a map can have, if they are known."""
    parts: Mapping[str, Type] = field(default_factory=dict, compare=False)
    """The types of its entries, if each has its own."""

    @property
    def phrase(self) -> str:
        """Return the type as used in a sentence: 'a ratio'."""
        if self.kind is TypeKind.QUANTITY and self.dimension:
            return self.dimension.phrase
        return self.kind.value

    @property
    def detail(self) -> str:
        """Return the phrase with its contents: 'one of red, green', 'a list, each a place'."""
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        return f"{self.phrase}, each {self.of.detail}" if self.of and self.of != UNKNOWN else self.phrase

    @property
    def measure(self) -> Dimension | None:
        """Return the dimension for computing, if there is one; a count is a number."""
        return NUMBER if self.kind is TypeKind.COUNT else self.dimension

    @property
    def entry(self) -> Type:
        """Return the type of an entry of a list or a map."""
        return self.of or UNKNOWN


COUNT = Type(TypeKind.COUNT)
TEXT = Type(TypeKind.TEXT)
FLAG = Type(TypeKind.FLAG)
PLACE = Type(TypeKind.PLACE)
POSE = Type(TypeKind.POSE)
UNKNOWN = Type(TypeKind.UNKNOWN)


def quantity_of(dimension: Dimension) -> Type:
    """Return the type of quantities of a dimension."""
    return Type(TypeKind.QUANTITY, dimension)


def choice_of(*choices: str) -> Type:
    """Return the type of one of these words."""
    return Type(TypeKind.CHOICE, choices=choices)


def list_of(entry: Type) -> Type:
    """Return the type of lists of `entry`."""
    return Type(TypeKind.LIST, of=entry)


def map_of(entry: Type, names: tuple[str, ...] = ()) -> Type:
    """Return the type of maps from names to `entry`; `names` are the only ones, if they are known."""
    return Type(TypeKind.MAP, of=entry, names=names)


def record_of(parts: Mapping[str, Type]) -> Type:
    """Return the type of maps whose entries have types of their own; each may be left out."""
    return Type(TypeKind.MAP, of=UNKNOWN, names=tuple(parts), parts=parts)


TYPES: Mapping[str, Type] = MappingProxyType(
    {
        **{name: quantity_of(dimension) for name, dimension in DIMENSIONS.items()},
        "count": COUNT,
        "text": TEXT,
        "flag": FLAG,
        "place": PLACE,
        "pose": POSE,
        "list": list_of(UNKNOWN),
        "map": map_of(UNKNOWN),
    }
)
"""The types that a manifest names by one word; a `choice` needs its choices: `choice_of`."""

# A text becomes a place where one is expected, and a place a pose.
_STANDS_FOR = {
    (TypeKind.TEXT, TypeKind.PLACE),
    (TypeKind.TEXT, TypeKind.POSE),
    (TypeKind.PLACE, TypeKind.POSE),
    (TypeKind.CHOICE, TypeKind.TEXT),
}
_EQUAL_ACROSS = {frozenset({TypeKind.TEXT, TypeKind.PLACE}), frozenset({TypeKind.TEXT, TypeKind.CHOICE})}


def accepts(expected: Type, given: Type) -> bool:
    """Return whether a value of the type `given` is allowed where `expected` is."""
    if UNKNOWN in (expected, given):
        return True
    if expected.dimension:
        return given.measure is not None and expected.dimension.is_comparable(given.measure)
    if expected.kind is not given.kind:
        return (given.kind, expected.kind) in _STANDS_FOR
    if expected.kind is TypeKind.CHOICE:
        return set(given.choices) <= set(expected.choices)
    return accepts(expected.entry, given.entry)


def are_comparable(type_: Type, other: Type) -> bool:
    """Return whether values of the two types can be tested for equality; not poses, which never match exactly."""
    if UNKNOWN in (type_, other):
        return True
    if type_.measure and other.measure:
        return type_.measure.is_comparable(other.measure)
    if type_.kind is other.kind:
        return type_.kind is not TypeKind.POSE
    return frozenset({type_.kind, other.kind}) in _EQUAL_ACROSS
