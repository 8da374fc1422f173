"""How a kind or a modifier declares the keys that it takes; reader, schema, slips and docs follow from this."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Self

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.types import COUNT, STEP, UNKNOWN
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.language.grammar import HISTORIES, KeySlot, Takes
from rbxcompose.missions.language.node_reader import FOREVER, NodeReader
from rbxcompose.missions.program.parts import Counted

HISTORY = "Where it restarts after it was halted: `last` at the child it was in, `deep` also inside that child."
_FIELD = "field of a mission"  # in the metadata of a dataclass's field


@dataclass(frozen=True, slots=True)
class Field:
    """A key of a step: what it takes, and how that is read.

    `key` is that of the attribute unless declared otherwise. The value of a field without an `attribute` is not kept:
    its nodes become children of the step, or another field has read it.
    """

    takes: Takes
    read: Callable[[NodeReader, str], Any]
    words: str  # what it takes
    help: str = ""
    key: str = ""
    is_required: bool = True
    default: Any = None
    choices: tuple[str, ...] = ()
    least: float | None = None  # the least number that makes sense
    counted: str = ""  # what findings call the number
    effect: str = ""  # what they say that a smaller number does, if not nothing
    keys: Mapping[str, Field] = dataclasses.field(default_factory=dict)  # of a record
    attribute: str = ""
    names: str = ""  # the kind of existing things whose names it takes

    @property
    def slot(self) -> KeySlot:
        """Return what the grammar knows of it."""
        return KeySlot(self.takes, self.choices)

    def value(self, reader: NodeReader) -> Any:
        """Read its value; return the default of one that is absent and need not be there."""
        return self.read(reader, self.key) if self.is_required or reader.has(self.key) else self.default


class Declared:
    """What is written with keys. The first field of a class stands behind the class's own key, its word.

    A field whose value is kept is annotated, and the class a dataclass: `lasts: Expression = duration()`. One whose
    nodes become children is not: `do = child()`.
    """

    __slots__ = ()
    name: ClassVar[str]  # the word
    declared: ClassVar[tuple[Field, ...]] = ()
    fields: ClassVar[Mapping[str, Field]]  # by key, the word first

    def __init_subclass__(cls) -> None:
        """Collect the fields, in their order."""
        super().__init_subclass__()
        if "declared" not in vars(cls):  # a dataclass with slots is made twice, the second time without its fields
            cls.declared = (*cls.declared, *_declared_in(vars(cls)))

    @classmethod
    def bind(cls, name: str) -> None:
        """Give the class its word."""
        word = dataclasses.replace
        named = [word(field, key=name, help=first_line(cls.__doc__)) for field in cls.declared[:1]]
        cls.name, cls.fields = name, {field.key: field for field in (*named, *cls.declared[1:])}

    @classmethod
    def options(cls) -> list[Field]:
        """Return its fields besides the word."""
        return [field for field in cls.fields.values() if field.key != cls.name]

    @classmethod
    def read(cls, reader: NodeReader) -> Self:
        """Read its fields."""
        make: Callable[..., Self] = cls
        return make(**cls.values(reader))

    @classmethod
    def values(cls, reader: NodeReader) -> dict[str, Any]:
        """Read its fields, and return what is kept by attribute."""
        values = [(field.attribute, field.value(reader)) for field in cls.fields.values()]
        return {name: value for name, value in values if name}

    @property
    def numbers(self) -> tuple[Counted, ...]:
        """Return its numbers, each with the least value that makes sense."""
        return tuple(
            Counted(field.counted or f"'{field.key}'", getattr(self, field.attribute), field.least, field.effect)
            for field in self.fields.values()
            if field.least is not None
        )


def _declared_in(namespace: Mapping[str, Any]) -> list[Field]:
    found = []
    for name, value in namespace.items():
        if isinstance(value, Field):
            found.append(dataclasses.replace(value, key=value.key or name))
        elif isinstance(value, dataclasses.Field) and (one := value.metadata.get(_FIELD)):
            found.append(dataclasses.replace(one, key=one.key or name, attribute=name))
    return found


def first_line(doc: str | None) -> str:
    """Return the first line of a docstring."""
    return (doc or "").strip().partition("\n")[0]


def kept(takes: Takes, read: Callable[[NodeReader, str], Any], words: str, help: str = "", **more: Any) -> Any:
    """Return a dataclass's field that keeps what `read` returns; for what no function below declares."""
    return dataclasses.field(metadata={_FIELD: Field(takes, read, words, help, **more)})


def condition(help: str = "") -> Any:
    """Declare a condition that is evaluated once."""
    return kept(Takes.CONDITION, NodeReader.condition, "a condition", help)


def watched(help: str = "", *, optional: bool = False) -> Any:
    """Declare a condition that is evaluated again and again while the node runs."""
    return kept(Takes.WATCHED, NodeReader.watched, "a condition", help, is_required=not optional)


def duration(help: str = "", *, optional: bool = False, **more: Any) -> Any:
    """Declare a duration; with its `least` value, smaller literals are findings."""
    words = "a duration, such as '5 s'"
    return kept(Takes.DURATION, NodeReader.duration, words, help, is_required=not optional, **more)


def value(what: str, help: str = "", *, holds_nodes: bool = False) -> Any:
    """Declare an expression of any type; nodes in the data that it may yield become children if it `holds_nodes`."""

    def read(reader: NodeReader, key: str) -> Any:
        expression = reader.expression(key, STEP if holds_nodes else UNKNOWN, what)
        if holds_nodes:
            reader.held(expression)
        return expression

    return kept(Takes.VALUE, read, "a value", help)


def count(*words: str, help: str = "", optional: bool = False, default: Any = None, **more: Any) -> Any:
    """Declare a whole number, or one of some words instead."""

    def read(reader: NodeReader, key: str) -> Any:
        return reader.count_or(key, words) if words else reader.expression(key, COUNT, "a number")

    return kept(
        Takes.COUNT, read, "a whole number", help, is_required=not optional, default=default, choices=words, **more
    )


def count_or_forever(**more: Any) -> Any:
    """Declare a whole number or `forever`, which is kept as None."""
    return kept(Takes.COUNT, NodeReader.count_or_forever, "a whole number", choices=(FOREVER,), **more)


def flag(help: str = "") -> Any:
    """Declare `true` or `false`, the default."""
    return kept(Takes.FLAG, NodeReader.flag, "`true` or `false`", help, is_required=False, default=False)


def choice(*choices: str, help: str = "") -> Any:
    """Declare one of some words; the first is the default."""

    def read(reader: NodeReader, key: str) -> str:
        return reader.choice(key, choices)

    return kept(Takes.CHOICE, read, "", help, is_required=False, default=choices[0], choices=choices)


def history() -> Any:
    """Declare where a node restarts after it was halted."""
    return choice(*HISTORIES, help=HISTORY)


def text(help: str = "", *, optional: bool = False) -> Any:
    """Declare a text in which `$name` is filled in."""
    return kept(Takes.TEXT, NodeReader.template, "a text", help, is_required=not optional)


def word(what: str, help: str = "", **more: Any) -> Any:
    """Declare the name of something that exists."""

    def read(reader: NodeReader, key: str) -> ScalarNode:
        return reader.scalar(key, what) or ScalarNode("", reader.key_span(key))

    return kept(Takes.WORD, read, what, help, **more)


def new_name(what: str, help: str = "", **more: Any) -> Any:
    """Declare a name for something new."""

    def read(reader: NodeReader, key: str) -> ScalarNode:
        return reader.name(key, what)

    return kept(Takes.NAME, read, what, help, **more)


def record(what: str, **keys: Any) -> Any:
    """Declare a map with these keys, each of which must be there; their scalars are kept in a tuple."""
    inner = {key: dataclasses.replace(topic.metadata[_FIELD], key=key) for key, topic in keys.items()}

    def read(reader: NodeReader, key: str) -> tuple[ScalarNode, ...]:
        return reader.record(key, what, {name: entry.words for name, entry in inner.items()})

    return kept(Takes.RECORD, read, what, keys=inner)


def assignments() -> Any:
    """Declare a map from names of data to expressions."""
    return kept(Takes.ASSIGNMENTS, NodeReader.assignments, "a map from data to values")


def inputs(help: str) -> Any:
    """Declare the values for the inputs of another mission."""
    read = NodeReader.inputs
    return kept(Takes.INPUTS, read, "a map from inputs to values", help, key="with", is_required=False, default=())


def message(body: str, names: str) -> Any:
    """Declare the target of a message, one of a kind of names; its contents are under the key `body`."""

    def read(reader: NodeReader, key: str) -> Any:
        return reader.message(key, body)

    return kept(Takes.WORD, read, "its name", names=names)


def contents(help: str, key: str = "") -> Field:
    """Declare the contents of a `message`, which that reads."""
    words = "a map of fields, or the value of the only one"
    return Field(Takes.CONTENTS, _nothing, words, help, key, is_required=False)


def hook(help: str = "") -> Field:
    """Declare what is done at a moment; `NodeReader.moments` reads all of a modifier."""
    return Field(Takes.HOOK, _nothing, "`set`, `log` or `publish`", help, is_required=False)


def item_name() -> Any:
    """Declare the name under which the nodes inside see the item of a loop."""
    return kept(Takes.ITEM_NAME, NodeReader.item_name, "a name for the item")


def items(help: str, key: str) -> Any:
    """Declare a literal list, or an expression that yields one."""
    return kept(Takes.ITEMS, NodeReader.items, "a list, or an expression", help, key=key)


def child(help: str = "", key: str = "", *, optional: bool = False) -> Field:
    """Declare a node that becomes the next child."""
    return Field(Takes.STEP, NodeReader.child, "a node", help, key, not optional)


def children() -> Field:
    """Declare a list of nodes."""
    return Field(Takes.STEPS, NodeReader.steps, "a list of nodes")


def branches() -> Any:
    """Declare a list of nodes, or a map with their names, which are kept."""
    return kept(Takes.BRANCHES, NodeReader.branches, "a list of nodes, or a map from names to nodes")


def branch(help: str) -> Any:
    """Declare the name of one of the `branches`."""
    return kept(Takes.BRANCH, NodeReader.branch, "the name of a branch", help, is_required=False)


def cases(help: str) -> Any:
    """Declare a map from values to nodes; the values are kept."""
    return kept(Takes.CASES, NodeReader.cases, "a map from values to nodes", help)


def _nothing(reader: NodeReader, key: str) -> None:
    """Read nothing: another field does."""
