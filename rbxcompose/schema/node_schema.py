"""The keys of a mission node: runs the code that reads a kind with a reader that records what it reads."""

from __future__ import annotations

from collections.abc import Iterable

from rbxcompose.expressions.text import Template
from rbxcompose.expressions.tree import Expression
from rbxcompose.expressions.types import COUNT, FLAG, UNKNOWN, Type, TypeKind
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode
from rbxcompose.missions.language.asked import Asked, Assignment
from rbxcompose.missions.language.grammar import Takes
from rbxcompose.missions.language.layout import Nobody
from rbxcompose.missions.language.node_reader import NodeReader
from rbxcompose.missions.language.value_reader import UNREADABLE
from rbxcompose.missions.modifiers.registry import modifiers
from rbxcompose.missions.program.messages import MessageTemplate
from rbxcompose.missions.program.modifier import Modifier
from rbxcompose.missions.program.moments import Moments
from rbxcompose.missions.program.registry import StepType
from rbxcompose.schema.scalars import DEFINITIONS, Schema, computed

NODE: Schema = {"$ref": f"{DEFINITIONS}node"}
STEPS: Schema = {"$ref": f"{DEFINITIONS}steps"}
EXPRESSION: Schema = {"type": ["string", "number", "boolean"]}
TEXT: Schema = {"type": ["string", "number", "boolean"]}
ITEM_NAME: Schema = {"type": "string", "pattern": "^[a-z][a-z0-9_]*$", "maxLength": 60}


MACHINE: Schema = {"$ref": f"{DEFINITIONS}machine"}
DEEDS: Schema = {"$ref": f"{DEFINITIONS}deeds"}
ANYTHING: Schema = {"type": ["string", "number", "boolean", "object", "array"]}
MAPS: dict[str, Schema] = {  # by the key whose value is the map
    "machine": MACHINE,
    "set_parameter": {
        "type": "object",
        "required": ["component", "parameter", "value"],
        "properties": {
            "component": {**ITEM_NAME, "description": "The component."},
            "parameter": {"type": "string", "description": "One of its settings that may change while it runs."},
            "value": {**EXPRESSION, "description": "The new value, of the type of the setting."},
        },
        "additionalProperties": False,
    },
    "outcomes": {"type": "object", "minProperties": 1, "propertyNames": ITEM_NAME, "additionalProperties": EXPRESSION},
    "with": {"type": "object", "minProperties": 1, "propertyNames": ITEM_NAME, "additionalProperties": ANYTHING},
}


class Asking(NodeReader):
    """A reader that has every key, and records the schema of each value requested from it."""

    def __init__(self, key: str) -> None:
        word = ScalarNode(key, MappingNode().span)
        super().__init__(MappingNode({key: Entry(word, word)}), key, 0, Nobody())
        self.schemas: dict[str, Schema] = {}
        self.optional: set[str] = set()

    def has(self, key: str) -> bool:
        """Return True, so that every key is requested."""
        self.optional.add(key)
        return True

    def scalar(self, key: str, what: str, takes: Takes = Takes.OTHER) -> ScalarNode | None:
        """Note a word."""
        self.schemas[key] = {"type": "string", "minLength": 1}
        return None

    def expression(self, key: str, wanted: Type, what: str) -> Expression:
        """Note an expression."""
        self.schemas[key] = EXPRESSION if wanted == UNKNOWN else computed(wanted)
        return UNREADABLE

    def count_or(self, key: str, words: tuple[str, ...]) -> Expression | str:
        """Note a whole number or some words."""
        listed = " or ".join(f"'{word}'" for word in words)
        count = computed(COUNT, f"a number or {listed}")
        pattern = "|".join([*(f"^{word}$" for word in words), str(count["pattern"])])
        self.schemas[key] = {**count, "pattern": pattern, "examples": [3, *words]}
        return words[0]

    def map_of(self, key: str, what: str, takes: Takes = Takes.OTHER) -> MappingNode | None:
        """Note a map."""
        self.schemas[key] = MAPS.get(key, {"type": "object", "minProperties": 1})
        return None

    def branch(self, key: str, branches: tuple[str, ...]) -> None:
        """Note a name."""
        self.schemas[key] = ITEM_NAME

    def name(self, key: str, what: str) -> ScalarNode:
        """Note a name."""
        self.schemas[key] = ITEM_NAME
        return ScalarNode("", MappingNode().span)

    def branches(self) -> tuple[str, ...]:
        """Note a list or a map of nodes."""
        several = {"minItems": 1, "items": NODE, "minProperties": 1, "additionalProperties": NODE}
        self.schemas[self.key] = {"type": ["object", "array"], "propertyNames": ITEM_NAME, **several}
        return ()

    def cases(self, key: str) -> tuple[Asked, ...]:
        """Note a map from values to nodes."""
        self.schemas[key] = {"type": "object", "minProperties": 1, "additionalProperties": NODE}
        return ()

    def message(self, target: str, body: str) -> MessageTemplate:
        """Note a name and what is sent."""
        self.schemas[target] = {"type": "string", "minLength": 1}
        self.schemas[body] = ANYTHING
        self.optional.add(body)
        return MessageTemplate(ScalarNode("", MappingNode().span), None)

    def moments(self, keys: Iterable[str]) -> Moments:
        """Note hooks, each of which may be missing."""
        for key in keys:
            self.schemas[key] = DEEDS
            self.optional.add(key)
        return Moments()

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

    def assignments(self, key: str) -> tuple[Assignment, ...]:
        """Note a map from names to expressions."""
        entries = {"propertyNames": ITEM_NAME, "additionalProperties": EXPRESSION}
        self.schemas[key] = {"type": "object", "minProperties": 1, **entries}
        return ()


def kind_schema(kind: StepType) -> tuple[dict[str, Schema], list[str]]:
    """Return the described schemas of the keys of a kind, and its required keys."""
    asking = Asking(kind.name)
    kind.read(asking)
    about = {kind.name: first_line(kind.__doc__), **kind.options}
    made = {key: {**schema, "description": about.get(key, "")} for key, schema in asking.schemas.items()}
    return made, sorted(set(made) - asking.optional)


def modifier_schemas() -> dict[str, Schema]:
    """Return the schemas of the modifiers, which any node may have."""
    made: dict[str, Schema] = {}
    for key, cls in modifiers().items():
        if not cls.only_states:
            made |= modifier_schema(key, cls)
    return made


def modifier_schema(key: str, cls: type[Modifier]) -> dict[str, Schema]:
    """Return the described schemas of the keys that a modifier reads."""
    asking = Asking(key)
    cls.read(asking, key)
    about = {key: first_line(cls.__doc__), **cls.keys}
    return {name: {**schema, "description": about[name]} for name, schema in asking.schemas.items()}


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
