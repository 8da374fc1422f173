"""What the keys of a mission node take: the code that reads a kind is run on a reader that writes down what it asks."""

from __future__ import annotations

from rbxcompose.expressions.text import Template
from rbxcompose.expressions.tree import Expression
from rbxcompose.expressions.types import COUNT, FLAG, UNKNOWN, Type, TypeKind
from rbxcompose.findings import Finding
from rbxcompose.manifest.tree import Entry, Mapping, Node, Scalar
from rbxcompose.missions.modifiers import MODIFIERS
from rbxcompose.missions.node_reader import FOREVER, UNREADABLE, NodeReader
from rbxcompose.missions.program import Assignment
from rbxcompose.missions.registry import Kind
from rbxcompose.schema.scalars import Schema, computed
from rbxcompose.schema.settle import DEFINITIONS

NODE: Schema = {"$ref": f"{DEFINITIONS}node"}
STEPS: Schema = {"$ref": f"{DEFINITIONS}steps"}
EXPRESSION: Schema = {"type": ["string", "number", "boolean"]}
TEXT: Schema = {"type": ["string", "number", "boolean"]}
ITEM_NAME: Schema = {"type": "string", "pattern": "^[a-z][a-z0-9_]*$", "maxLength": 60}


class _Nobody:
    """Takes what a reader would hand on: there is nothing to be read."""

    def child(self, node: Node, step: str, parent: int) -> int:
        """Give every node the same number."""
        return 0

    def add(self, finding: Finding) -> None:
        """Drop it: an empty mapping lacks everything."""


class Asking(NodeReader):
    """A reader that has every key, and keeps for each the schema of what it is asked for."""

    def __init__(self, key: str) -> None:
        word = Scalar(key, Mapping().span)
        super().__init__(Mapping({key: Entry(word, word)}), key, 0, _Nobody())
        self.schemas: dict[str, Schema] = {}
        self.optional: set[str] = set()

    def has(self, key: str) -> bool:
        """Say yes, so that everything is asked for."""
        self.optional.add(key)
        return True

    def expression(self, key: str, wanted: Type, what: str) -> Expression:
        """Note an expression."""
        self.schemas[key] = EXPRESSION if wanted == UNKNOWN else computed(wanted)
        return UNREADABLE

    def count_or_forever(self, key: str) -> Expression | None:
        """Note a whole number or `forever`."""
        count = computed(COUNT, f"a number or '{FOREVER}'")
        self.schemas[key] = {**count, "pattern": f"^{FOREVER}$|{count['pattern']}", "examples": [3, FOREVER]}
        return None

    def flag(self, key: str) -> bool:
        """Note `true` or `false`."""
        self.schemas[key] = {"type": ["boolean", "string"], "pattern": r"\$\{", "examples": [True]}
        return False

    def choice(self, key: str, choices: tuple[str, ...]) -> str:
        """Note one of some words."""
        self.optional.add(key)
        self.schemas[key] = {"enum": list(choices), "default": choices[0]}
        return choices[0]

    def template(self, key: str) -> Template:
        """Note a text."""
        self.schemas[key] = TEXT
        return Template("", ())

    def child(self, key: str) -> None:
        """Note a node."""
        self.schemas[key] = NODE
        self.children.append(0)

    def steps(self) -> None:
        """Note a list of nodes."""
        self.schemas[self.key] = STEPS

    def item_name(self) -> None:
        """Note a name."""
        self.schemas[self.key] = ITEM_NAME

    def items(self, key: str) -> Expression | tuple[Expression, ...]:
        """Note a list, or an expression that gives one."""
        words = {"type": "array", "items": {**EXPRESSION, "x-names": "place"}}
        self.schemas[key] = {"anyOf": [words, {"type": "string"}]}
        return ()

    def assignments(self) -> tuple[Assignment, ...]:
        """Note a map from names to expressions."""
        entries = {"propertyNames": ITEM_NAME, "additionalProperties": EXPRESSION}
        self.schemas[self.key] = {"type": "object", "minProperties": 1, **entries}
        return ()


def kind_schema(kind: Kind) -> tuple[dict[str, Schema], list[str]]:
    """Return the schemas of the keys of a kind, described, and those that must be there."""
    asking = Asking(kind.name)
    kind.task.read(asking)
    about = {kind.name: first_line(kind.task.__doc__), **kind.options}
    made = {key: {**_beside(schema), "description": about.get(key, "")} for key, schema in asking.schemas.items()}
    return made, sorted(set(made) - asking.optional)


def modifier_schemas() -> dict[str, Schema]:
    """Return the schemas of the modifiers, which any node may have."""
    made = {}
    for key, cls in MODIFIERS.items():
        asking = Asking(key)
        cls.read(asking, key)
        made[key] = {**_beside(asking.schemas[key]), "description": first_line(cls.__doc__)}
    return made


def argument_schema(wanted: Type) -> Schema:
    """Return the schema of an argument of a skill."""
    if wanted.kind in (TypeKind.PLACE, TypeKind.POSE):
        return {"type": ["string", "object"], "minLength": 1, "x-names": "place"}
    if wanted.kind is TypeKind.FLAG:
        return computed(FLAG)
    return EXPRESSION if wanted.kind is not TypeKind.TEXT else TEXT


def first_line(doc: str | None) -> str:
    """Return the first line of a docstring."""
    return (doc or "").strip().partition("\n")[0]


def _beside(schema: Schema) -> Schema:
    return {"allOf": [schema]} if "$ref" in schema else dict(schema)
