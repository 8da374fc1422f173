"""Types of expressions, known without their values; and which type fits where."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from enum import Enum
from itertools import product
from types import MappingProxyType

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.units import DIMENSIONS, NUMBER, QUOTIENT, Dimension

_LISTED = 4  # entries of a map that a sentence names


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
    STEP = "a step from the data"
    ONE_OF = "one of several"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Type:
    """The type of a value: a quantity has a dimension, a choice its words, a list or map the type of its entries.

    A value that may have one of several types, such as an entry of `[5 m, 3 s]`, has these as `members`.
    """

    kind: TypeKind
    dimension: Dimension | None = None
    choices: tuple[str, ...] = ()
    of: Type | None = None
    members: tuple[Type, ...] = ()
    names: tuple[str, ...] = field(default=(), compare=False)
    """The only entries that a map can have, if they are known."""
    parts: Mapping[str, Type] = field(default_factory=dict, compare=False)
    """The types of its entries by name, those of the items of a list by number, as far as each is known."""

    @property
    def phrase(self) -> str:
        """Return the type as used in a sentence: 'a ratio'."""
        if self.kind is TypeKind.QUANTITY and self.dimension:
            return self.dimension.phrase
        return " or ".join(member.phrase for member in self.members) or self.kind.value

    @property
    def detail(self) -> str:
        """Return the phrase with its contents: 'one of red, green', 'a list, each a place'."""
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        if self.kind is TypeKind.MAP and self.entry.members:
            shown = [f"{name}: {part.phrase}" for name, part in self.parts.items()]
            return f"{self.phrase} with {', '.join(shown[:_LISTED])}{', ...' * (len(shown) > _LISTED)}"
        return f"{self.phrase}, each {self.of.detail}" if self.of and self.of != UNKNOWN else self.phrase

    @property
    def measure(self) -> Dimension | None:
        """Return the dimension for computing, if there is one; a count is a number."""
        return NUMBER if self.kind is TypeKind.COUNT else self.dimension

    @property
    def entry(self) -> Type:
        """Return the type of an entry of a list or a map."""
        return self.of or UNKNOWN

    @property
    def each(self) -> tuple[Type, ...]:
        """Return the types that a value may have: the members of one of several, else this one."""
        return self.members or (self,)

    def part(self, name: str) -> Type:
        """Return the type of the entry of a name, or of the item of a number."""
        return self.parts.get(name) or (UNKNOWN if self.entry.members else self.entry)


COUNT = Type(TypeKind.COUNT)
TEXT = Type(TypeKind.TEXT)
FLAG = Type(TypeKind.FLAG)
PLACE = Type(TypeKind.PLACE)
POSE = Type(TypeKind.POSE)
STEP = Type(TypeKind.STEP)
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


def list_with(items: Sequence[Type]) -> Type:
    """Return the type of a list with items of these types."""
    return Type(TypeKind.LIST, of=common(items), parts={str(index): item for index, item in enumerate(items)})


def map_with(entries: Mapping[str, Type]) -> Type:
    """Return the type of a map with entries of these types; it may get others."""
    return Type(TypeKind.MAP, of=common(entries.values()), parts=entries)


def common(types: Iterable[Type]) -> Type:
    """Return the type of a value that has one of these types; maps become one, and so do lists."""
    members: list[Type] = []
    for type_ in (each for one in types for each in one.each):
        if type_ == UNKNOWN:
            return UNKNOWN
        for index, member in enumerate(members):
            if (both := _merged(member, type_)) is not None:
                members[index] = both
                break
        else:
            members.append(type_)
    if len(members) > 1:
        return Type(TypeKind.ONE_OF, members=tuple(members))
    return members[0] if members else UNKNOWN


def wider(type_: Type, other: Type) -> Type:
    """Return the type of what is one of two measured values that can be compared."""
    if type_ == other:
        return type_
    vague = (COUNT, quantity_of(QUOTIENT))
    return next((found for found in (type_, other) if found not in vague), quantity_of(NUMBER))


def _merged(type_: Type, other: Type) -> Type | None:
    """Return the one type of what is of either, None if there is none."""
    if type_.measure and other.measure:
        return wider(type_, other) if type_.measure.is_comparable(other.measure) else None
    if type_.kind is other.kind and type_.of and other.of:
        names = dict.fromkeys((*type_.parts, *other.parts))
        if type_.kind is TypeKind.LIST and type_.parts.keys() != other.parts.keys():
            names = {}
        found = {name: [part for one in (type_, other) if (part := _there(one, name))] for name in names}
        parts = {name: common(each) for name, each in found.items()}
        return Type(type_.kind, of=common((type_.of, other.of)), parts=parts)
    return type_ if accepts(type_, other) else other if accepts(other, type_) else None


def _there(type_: Type, name: str) -> Type | None:
    """Return the type of an entry; None if it is known that there is none."""
    return type_.parts.get(name) if type_.parts else type_.part(name)


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

PLACED, STRUCTURED = (TypeKind.PLACE, TypeKind.POSE), (TypeKind.LIST, TypeKind.MAP)

# A text becomes a place where one is expected, and a place a pose; a step is shown as a text.
_STANDS_FOR = {
    (TypeKind.TEXT, TypeKind.PLACE),
    (TypeKind.TEXT, TypeKind.POSE),
    (TypeKind.PLACE, TypeKind.POSE),
    (TypeKind.CHOICE, TypeKind.TEXT),
    (TypeKind.STEP, TypeKind.TEXT),
}
_EQUAL_ACROSS = {frozenset({TypeKind.TEXT, TypeKind.PLACE}), frozenset({TypeKind.TEXT, TypeKind.CHOICE})}


def accepts(expected: Type, given: Type) -> bool:
    """Return whether a value of the type `given` is allowed where `expected` is."""
    if UNKNOWN in (expected, given):
        return True
    if given.members:
        return all(accepts(expected, member) for member in given.members)
    if expected.members:
        return any(_holds(member, given) for member in expected.members)
    if expected.dimension:
        return given.measure is not None and expected.dimension.is_comparable(given.measure)
    if expected.kind is not given.kind:
        return (given.kind, expected.kind) in _STANDS_FOR
    if expected.kind is TypeKind.CHOICE:
        return set(given.choices) <= set(expected.choices)
    parts = ((part, _there(given, name)) for name, part in expected.parts.items())
    return _holds(expected.entry, given.entry) and all(found is None or _holds(part, found) for part, found in parts)


def _holds(entry: Type, given: Type) -> bool:
    """Return whether a value may be an entry: `[0]` does not say that it stays whole, a text may name a place."""
    entry = quantity_of(NUMBER) if entry == COUNT else entry
    return (entry, given) == (TEXT, PLACE) or accepts(entry, given)


def are_comparable(type_: Type, other: Type) -> bool:
    """Return whether values of the two types can be tested for equality; not poses, which never match exactly."""
    if UNKNOWN in (type_, other):
        return True
    if type_.members or other.members:
        pairs = list(product(type_.each, other.each))
        measured = [pair for pair in pairs if pair[0].measure and pair[1].measure]
        return any(are_comparable(*pair) for pair in pairs) and all(are_comparable(*pair) for pair in measured)
    if type_.measure and other.measure:
        return type_.measure.is_comparable(other.measure)
    if type_.kind is other.kind:
        return type_.kind is not TypeKind.POSE
    return frozenset({type_.kind, other.kind}) in _EQUAL_ACROSS
