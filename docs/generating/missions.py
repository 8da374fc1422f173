"""The reference of missions: keys of the file, kinds of nodes, modifiers, skills."""

from __future__ import annotations

from collections.abc import Mapping

from docs.generating.components import ports_of
from docs.generating.markdown import about, code, example, example_of, lowered, page, table
from docs.generating.shapes import keys_table
from rbxcompose.compiler.schema.mission import mission_schema
from rbxcompose.compiler.schema.scalars import SHARED, Schema, referred
from rbxcompose.manifest.arguments import ArgumentModel
from rbxcompose.missions.language.fields import Field, first_line
from rbxcompose.missions.language.grammar import Takes
from rbxcompose.missions.language.reader import INTERRUPT_KEYS
from rbxcompose.missions.program.goals import skill_of, topic_skill
from rbxcompose.missions.program.registry import StepType, kinds, modifiers
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


def whole_page() -> str:
    """Return the page."""
    schema = mission_schema(sorted(PLUGINS.shipped))
    states = {key: referred(property_, schema) for key, property_ in schema[SHARED]["state"]["properties"].items()}
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
    rows = [(code(key), "yes" if key in required else "", schema["description"]) for key, schema in properties.items()]
    return table(("key", "required", "what it is"), rows)


def of_kind(kind: StepType) -> str:
    """Return what is known of a kind: what it does, its keys, an example."""
    absent = {True: "", False: "; optional"}
    others = [(code(option.key), takes(option) + absent[option.is_required], option.help) for option in kind.options()]
    rows = [(code(kind.name), takes(kind.fields[kind.name]), ""), *others]
    return "\n".join(
        [f"### {code(kind.name)}\n{about(kind)}\n", table(_HEAD, rows), example(example_of(kind), "yaml mission")]
    )


def takes(field: Field) -> str:
    """Return what a key takes."""
    words = " or ".join(map(code, field.choices))
    if field.takes is Takes.CHOICE:
        return f"{words} (the first one)"
    return f"{field.words} or {words}" if words else field.words


def of_modifier(name: str) -> str:
    """Return what is known of a modifier."""
    cls = modifiers()[name]
    words = f"### {code(name)}\n{about(cls)} It takes {takes(cls.fields[name])}.\n"
    others = [(code(option.key), takes(option), option.help) for option in cls.options()]
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
                arguments = [f"{code(key)}: {argument.phrase}" for key, argument in skill.arguments.items()]
                what = f"{code(name)}: {lowered(first_line(component_type(name).__doc__))}"
                rows.append((code(skill.name), ", ".join(arguments) or "none", what, code(port.interface.TYPE)))
    return rows
