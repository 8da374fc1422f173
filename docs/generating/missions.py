"""The reference of missions: keys of the file, kinds of nodes, modifiers, skills."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from docs.generating.components import ports_of
from docs.generating.markdown import about, code, example, example_of, lowered, page, table
from docs.generating.shapes import keys_table
from rbxcompose.expressions.text import Template
from rbxcompose.expressions.tree import Expression
from rbxcompose.expressions.types import UNKNOWN, Type
from rbxcompose.manifest.arguments import ArgumentModel
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.language.asked import Asked, Assignment
from rbxcompose.missions.language.grammar import Takes
from rbxcompose.missions.language.reader import INTERRUPT_KEYS
from rbxcompose.missions.modifiers.registry import modifiers
from rbxcompose.missions.program.goals import skill_of, topic_skill
from rbxcompose.missions.program.messages import MessageTemplate
from rbxcompose.missions.program.moments import Moments
from rbxcompose.missions.program.registry import StepType, kinds
from rbxcompose.schema.mission import mission_schema
from rbxcompose.schema.node_schema import Asking, first_line
from rbxcompose.schema.scalars import SHARED, Schema
from rbxcompose.schema.settle import referred
from rbxcompose.sdk.ports import ServesAction, ServesTopic
from rbxcompose.sdk.registry import PLUGINS, component_type

NODES = """## Nodes
A node is a word (a skill without arguments), a list (a `sequence`), or a map with exactly one kind or skill, its
options and [modifiers](#modifiers). Any node may have a `name`. Each ends in success, in failure, or skipped.
"""
SKILLS = """## Skills
Every action of a component of the robot is a skill, named after the last word of its topic. These are the
skills of the shipped types; a single value is the first argument.

"""
ORDER = "## Modifiers\nAny node may have modifiers. They apply from the outside in, in this order:"
_HEAD = ("key", "takes", "what it is")


class Told(Asking):
    """A reader that has every key, and keeps for each in words what it takes."""

    def __init__(self, key: str) -> None:
        super().__init__(key)
        self.words: dict[str, str] = {}

    def scalar(self, key: str, what: str, takes: Takes = Takes.OTHER) -> ScalarNode | None:
        """Note a word."""
        self.words[key] = what
        return super().scalar(key, what)

    def expression(self, key: str, wanted: Type, what: str) -> Expression:
        """Note what is asked for."""
        self.words[key] = "a value" if wanted == UNKNOWN else what
        return super().expression(key, wanted, what)

    def count_or(self, key: str, words: tuple[str, ...]) -> Expression | str:
        """Note a number or words."""
        self.words[key] = " or ".join(["a whole number", *map(code, words)])
        return super().count_or(key, words)

    def map_of(self, key: str, what: str, takes: Takes = Takes.OTHER) -> None:
        """Note a map."""
        self.words[key] = what
        super().map_of(key, what)

    def branch(self, key: str, branches: tuple[str, ...]) -> str:
        """Note a name."""
        self.words[key] = "the name of a branch"
        return super().branch(key, branches)

    def name(self, key: str, what: str) -> ScalarNode:
        """Note a name."""
        self.words[key] = what
        return super().name(key, what)

    def branches(self) -> tuple[str, ...]:
        """Note nodes."""
        self.words[self.key] = "a list of nodes, or a map from names to nodes"
        return super().branches()

    def cases(self, key: str) -> tuple[Asked, ...]:
        """Note a map."""
        self.words[key] = "a map from values to nodes"
        return super().cases(key)

    def message(self, target: str, body: str) -> MessageTemplate:
        """Note a name and what is sent."""
        self.words[target], self.words[body] = "its name", "a map of fields, or the value of the only one"
        return super().message(target, body)

    def moments(self, keys: Iterable[str]) -> Moments:
        """Note hooks."""
        told = list(keys)
        self.words.update(dict.fromkeys(told, "`set`, `log` or `publish`"))
        return super().moments(told)

    def flag(self, key: str) -> bool:
        """Note a flag."""
        self.words[key] = "`true` or `false`"
        return super().flag(key)

    def choice(self, key: str, choices: tuple[str, ...]) -> str:
        """Note the words, the default first."""
        self.words[key] = " or ".join(map(code, choices)) + (" (the first one)" if len(choices) > 1 else "")
        return super().choice(key, choices)

    def template(self, key: str) -> Template:
        """Note a text."""
        self.words[key] = "a text"
        return super().template(key)

    def child(self, key: str) -> None:
        """Note a node."""
        self.words[key] = "a node"
        super().child(key)

    def steps(self) -> None:
        """Note a list."""
        self.words[self.key] = "a list of nodes"
        super().steps()

    def item_name(self) -> None:
        """Note a name."""
        self.words[self.key] = "a name for the item"
        super().item_name()

    def items(self, key: str) -> Expression | tuple[Expression, ...]:
        """Note a list of values."""
        self.words[key] = "a list, or an expression"
        return super().items(key)

    def assignments(self, key: str) -> tuple[Assignment, ...]:
        """Note a map."""
        self.words[key] = "a map from data to values"
        return super().assignments(key)


def whole_page() -> str:
    """Return the page."""
    schema = mission_schema(sorted(PLUGINS.shipped))
    states = {key: referred(one, schema) for key, one in schema[SHARED]["state"]["properties"].items()}
    interrupt = schema["properties"]["interrupts"]["additionalProperties"]["properties"]
    return page(
        "Missions",
        f"## Keys of the file\n{described(schema['properties'], schema['required'])}",
        f"### An input\n{keys_table(ArgumentModel)}",
        f"### An interrupt\n{described({key: interrupt[key] for key in INTERRUPT_KEYS}, ['when'])}",
        NODES,
        *(of_kind(kind) for kind in kinds().values()),
        f"### States of a machine\n{described(states, [])}",
        ORDER,
        *(of_modifier(name) for name in modifiers()),
        SKILLS + table(("skill", "arguments", "component", "action or topic"), skills()),
    )


def described(properties: Mapping[str, Schema], required: list[str]) -> str:
    """Return a table of keys with what they are for."""
    rows = [(code(key), "yes" if key in required else "", one["description"]) for key, one in properties.items()]
    return table(("key", "required", "what it is"), rows)


def of_kind(kind: StepType) -> str:
    """Return what is known of a kind: what it does, its keys, an example."""
    told = told_by(kind)
    rows = [(code(key), takes(told, key), kind.options.get(key, "")) for key in told.words]
    return "\n".join(
        [
            f"### {code(kind.name)}\n{about(kind)}\n",
            table(_HEAD, rows),
            example(example_of(kind), "yaml mission"),
        ]
    )


def told_by(kind: StepType) -> Told:
    """Return what each key of a kind takes."""
    told = Told(kind.name)
    kind.read(told)
    return told


def takes(told: Told, key: str) -> str:
    """Return what a key takes, and whether it may be missing."""
    return told.words[key] + ("; optional" if key in told.optional and key != told.key else "")


def of_modifier(name: str) -> str:
    """Return what is known of a modifier."""
    told, cls = Told(name), modifiers()[name]
    cls.read(told, name)
    words = f"### {code(name)}\n{about(cls)} It takes {told.words[name]}.\n"
    others = [(code(key), told.words[key], meaning) for key, meaning in cls.keys.items()]
    return "\n".join([words, *([table(_HEAD, others)] if others else []), example(example_of(cls), "yaml mission")])


def skills() -> list[tuple[str, ...]]:
    """Return the row of each skill that ships."""
    rows: list[tuple[str, ...]] = []
    for name in sorted(PLUGINS.shipped):
        for port in ports_of(name).values():
            named = port.skill if isinstance(port, ServesAction) else ""
            if isinstance(port, ServesAction | ServesTopic) and port.interface and named is not None:
                make = skill_of if isinstance(port, ServesAction) else topic_skill
                skill = make(port.interface, named or port.topic.rpartition("/")[2], entries=port.entries)
                arguments = [f"{code(key)}: {one.phrase}" for key, one in skill.arguments.items()]
                what = f"{code(name)}: {lowered(first_line(component_type(name).__doc__))}"
                rows.append((code(skill.name), ", ".join(arguments) or "none", what, code(port.interface.TYPE)))
    return rows
