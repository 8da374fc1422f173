"""Schema of a mission file: nodes by kind, modifiers, and the skills of the known component types."""

import inspect
from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import Any

from rbxcompose.base.config import NAMES, Name
from rbxcompose.base.expressions.types import COUNT, FLAG, PLACED, TYPES, Type, TypeKind, quantity_of
from rbxcompose.base.units import TIME
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.model.skills import usable_skills
from rbxcompose.compiler.schema.robot import document
from rbxcompose.compiler.schema.scalars import DEFINITIONS, Schema, computed, schemas_of
from rbxcompose.manifest.arguments import ArgumentModel
from rbxcompose.manifest.documents import ManifestHeader
from rbxcompose.missions.kinds.machine import RESULTS
from rbxcompose.missions.language.fields import HISTORY, Declared, Field, first_line
from rbxcompose.missions.language.grammar import HISTORIES, Takes
from rbxcompose.missions.language.reader import INTERRUPT_KEYS, KEYS
from rbxcompose.missions.modifiers.starts import ON_ENTER
from rbxcompose.missions.program.goals import skill_of, topic_skill
from rbxcompose.missions.program.parts import DEEDS, MACHINE_KEYS, STATE
from rbxcompose.missions.program.program import AFTERWARDS, RESTART, Skill
from rbxcompose.missions.program.registry import kinds, modifiers
from rbxcompose.missions.sources import SkillSource, SkillWay
from rbxcompose.sdk.ports import ServesAction, ServesTopic
from rbxcompose.sdk.registry import component_type, skill_type

NODE: Schema = {"$ref": f"{DEFINITIONS}node"}
MACHINE: Schema = {"$ref": f"{DEFINITIONS}machine"}
EXPRESSION: Schema = {"type": ["string", "number", "boolean"]}
ANYTHING: Schema = {"type": ["string", "number", "boolean", "object", "array"]}
ITEM_NAME: Schema = {"type": "string", "pattern": "^[a-z][a-z0-9_]*$", "maxLength": 60}
WORD: Schema = {"type": "string", "minLength": 1}
_MAP: Schema = {"type": "object", "minProperties": 1}
_SEVERAL = {"minItems": 1, "items": NODE, "minProperties": 1, "additionalProperties": NODE}
_NAMED: Schema = {**_MAP, "propertyNames": ITEM_NAME, "additionalProperties": EXPRESSION}
_TAKEN: Mapping[Takes, Schema] = {
    Takes.CONDITION: computed(FLAG),
    Takes.WATCHED: WORD,
    Takes.DURATION: computed(quantity_of(TIME)),
    Takes.VALUE: EXPRESSION,
    Takes.FLAG: {"type": ["boolean", "string"], "pattern": r"\$\{", "examples": [True]},
    Takes.TEXT: EXPRESSION,
    Takes.WORD: WORD,
    Takes.NAME: ITEM_NAME,
    Takes.BRANCH: ITEM_NAME,
    Takes.ITEM_NAME: ITEM_NAME,
    Takes.ITEMS: {"anyOf": [{"type": "array", "items": {**EXPRESSION, "x-names": "place"}}, {"type": "string"}]},
    Takes.STEP: NODE,
    Takes.STEPS: {"$ref": f"{DEFINITIONS}steps"},
    Takes.BRANCHES: {"type": ["object", "array"], "propertyNames": ITEM_NAME, **_SEVERAL},
    Takes.CASES: {**_MAP, "additionalProperties": NODE},
    Takes.ASSIGNMENTS: _NAMED,
    Takes.OUTCOMES: _NAMED,
    Takes.INPUTS: {**_NAMED, "additionalProperties": ANYTHING},
    Takes.CONTENTS: ANYTHING,
    Takes.HOOK: {"$ref": f"{DEFINITIONS}deeds"},
    Takes.MACHINE: MACHINE,
}

KIND = "kind_"  # prefix of the definition of a kind of node
ANY_NODE = "What is done: a skill, a kind of node with its settings, or a list of nodes, which is a sequence."
NODE_NAME: Schema = {
    **ITEM_NAME,
    "description": "Names the node for viewers, tests and logs; a name belongs to one node only.",
}
_ABOUT = {
    "inputs": "What is given to the mission when it starts: typed values by name.",
    "data": "The mission's own data by name, with initial values; `set` changes them.",
    "interrupts": "Conditions that cut the mission short, by name; the first one that holds wins.",
    "rate": "How often conditions are evaluated whose changes are not announced.",
    "outputs": "What the mission returns to one that uses it: expressions by name.",
    "do": "What the mission does.",
    "machine": "What the mission does, as a state machine.",
    "when": "The condition that cuts the mission short.",
    "reaction": "What is done then.",
    "afterwards": "What comes after the reaction: `continue` resumes what was cut short, `restart` restarts the "
    "mission, or the step named below it, `end` ends the mission in success.",
}
_MACHINE = {
    "start": "The state in which it starts.",
    "states": "The states by name.",
    "ends": "Ends besides `finished` and `failed`, each with what it counts as.",
    "history": HISTORY,
}
_STATE = {
    "do": "What is done in the state; how it ends decides where the machine goes.",
    "machine": "A machine within the state.",
    "next": "The next state or end by outcome, or one word if the body cannot fail.",
}


class MissionFile(ManifestHeader):
    """A mission: what the robot does, as a tree of nodes."""


DescribedSkills = Mapping[str, tuple[Skill, str]]
"""Skills by name, each with a description."""


def mission_schema(types: Iterable[str], skills: DescribedSkills = MappingProxyType({})) -> Schema:
    """Return the schema of a mission's file for robots that may use these types of components.

    `skills` are those of a known robot: some depend on the configurations of its components.
    """
    schemas, definitions = schemas_of({"inputs": dict[Name, ArgumentModel]})
    properties: dict[str, Schema] = {
        "inputs": {**schemas["inputs"], "type": ["object", "null"]},
        "data": {"type": ["object", "null"], "propertyNames": ITEM_NAME},
        "interrupts": {"type": ["object", "null"], "propertyNames": ITEM_NAME, "additionalProperties": _interrupt()},
        "rate": computed(TYPES["frequency"]),
        "outputs": {"type": ["object", "null"], "propertyNames": ITEM_NAME, "additionalProperties": EXPRESSION},
        "do": NODE,
        "machine": MACHINE,
    }
    made = {key: {**properties[key], "description": _ABOUT[key]} for key in KEYS if key in properties}
    schema = document("Mission", MissionFile, made, definitions | _nodes(types, skills))
    # `check` reports which of the two bodies is missing: editors name neither well when a choice fails.
    return {**schema, "anyOf": [{"required": ["do"]}, {"required": ["machine"]}]}


def _interrupt() -> Schema:
    properties = {
        "when": {**computed(FLAG), "description": _ABOUT["when"]},
        "do": {**NODE, "description": _ABOUT["reaction"]},
        "afterwards": {
            "type": ["string", "object"],
            "pattern": "|".join(f"^{word}$" for word in AFTERWARDS),
            "examples": list(AFTERWARDS),
            "default": AFTERWARDS[0],
            "properties": {RESTART: {**ITEM_NAME, "description": "A node, a state, or the item of a loop."}},
            "required": [RESTART],
            "additionalProperties": False,
            "description": _ABOUT["afterwards"],
        },
    }
    return {
        "type": "object",
        "description": "One condition, and what is done when it holds.",
        "properties": {key: properties[key] for key in INTERRUPT_KEYS},
        "required": ["when"],
        "additionalProperties": False,
    }


def _nodes(types: Iterable[str], skills: DescribedSkills) -> dict[str, Schema]:
    """Return the definitions of a node and of a list of nodes."""
    found = {**skills_of(types), **skills}
    of_nodes = (schemas_of_keys(modifier) for modifier in modifiers().values() if not modifier.only_states)
    anywhere = {"name": NODE_NAME, **{key: schema for entry in of_nodes for key, schema in entry.items()}}
    known = {name: _skill(skill, about) for name, (skill, about) in found.items()}
    closed: dict[str, Schema] = {}
    for name, kind in kinds().items():
        allowed = {**schemas_of_keys(kind), **dict.fromkeys(anywhere, True)}
        needed = sorted(key for key, field in kind.fields.items() if field.is_required)
        closed[name] = {"properties": allowed, "required": needed, "additionalProperties": False}
    words = {name: _key_of(f"{KIND}{name}", name) for name in closed}
    chosen: list[Schema] = [
        {"if": {"required": [name]}, "then": {"$ref": f"{DEFINITIONS}{KIND}{name}"}} for name in closed
    ]
    # What can be chosen is kept apart, so that editors do not propose a second step beside an existing one.
    is_open = {"not": {"anyOf": [schema["if"] for schema in chosen]}}
    chosen.append({"if": is_open, "then": {"properties": {**words, **known}}})
    word: Schema = {"type": "string", "minLength": 1, "examples": list(known)}
    steps: Schema = {"type": "array", "minItems": 1, "items": NODE}
    mapping = {"type": "object", "minProperties": 1, "properties": anywhere, "allOf": chosen}
    # One schema with several types, not a choice: editors then report the mistake for the type that is there.
    node = {**word, **steps, **mapping, "type": ["string", "array", "object"], "description": ANY_NODE}
    listed = {**steps, "description": "Nodes, one after the other."}
    shared = {"node": node, "steps": listed, "deeds": _deeds(), "machine": _machine(), "state": _state(anywhere)}
    return {**shared, **{f"{KIND}{name}": schema for name, schema in closed.items()}}


def schemas_of_keys(cls: type[Declared]) -> dict[str, Schema]:
    """Return the described schemas of the keys of a kind or a modifier."""
    return {key: _described(field) for key, field in cls.fields.items()}


def _described(field: Field) -> Schema:
    names = {NAMES: field.names} if field.names else {}
    return {**_of_field(field), "description": field.help, **names}


def _of_field(field: Field) -> Schema:
    match field:
        case Field(takes=Takes.CHOICE, choices=choices):
            return {"enum": list(choices), "default": choices[0]}
        case Field(takes=Takes.COUNT, choices=()):
            return computed(COUNT)
        case Field(takes=Takes.COUNT, choices=words):
            count = computed(COUNT, f"a number or {' or '.join(map(repr, words))}")
            pattern = "|".join([*(f"^{word}$" for word in words), str(count["pattern"])])
            return {**count, "pattern": pattern, "examples": [3, *words]}
        case Field(takes=Takes.RECORD, keys=keys):
            inner = {key: _described(one) for key, one in keys.items()}
            return {"type": "object", "required": list(keys), "properties": inner, "additionalProperties": False}
    return _TAKEN[field.takes]


def _argument(wanted: Type) -> Schema:
    """Return the schema of an argument of a skill."""
    if wanted.kind in PLACED:
        return {**WORD, "type": ["string", "object"], "x-names": "place"}
    return computed(FLAG) if wanted.kind is TypeKind.FLAG else EXPRESSION


def _key_of(definition: str, key: str) -> Schema:
    """Return a reference to the schema of a key in a definition."""
    return {"$ref": f"{DEFINITIONS}{definition}/properties/{key}"}


def _deeds() -> Schema:
    """Return the schema of the actions of a hook."""
    keys = {key: _key_of(f"{KIND}{word}", key) for word in DEEDS for key in kinds()[word].fields}
    return {"type": "object", "minProperties": 1, "properties": keys, "additionalProperties": False}


def _machine() -> Schema:
    """Return the schema of a machine."""
    ends = {"type": "object", "propertyNames": ITEM_NAME, "additionalProperties": {"enum": list(RESULTS)}}
    states = {
        "type": "object",
        "minProperties": 1,
        "propertyNames": ITEM_NAME,
        "additionalProperties": {"$ref": f"{DEFINITIONS}state"},
    }
    keys: dict[str, Schema] = {
        "start": ITEM_NAME,
        "states": states,
        "ends": ends,
        "history": {"enum": list(HISTORIES), "default": HISTORIES[0]},
    }
    found = {key: {**keys[key], "description": _MACHINE[key]} for key in MACHINE_KEYS}
    return {"type": "object", "properties": found, "required": ["start", "states"], "additionalProperties": False}


def _state(anywhere: dict[str, Schema]) -> Schema:
    """Return the schema of a state: its body, its transitions, and the keys that any node may have."""
    leading = {**ITEM_NAME, NAMES: STATE}
    to = {
        "type": ["string", "object"],
        NAMES: STATE,
        "minLength": 1,
        "minProperties": 1,
        "additionalProperties": leading,
    }
    own: dict[str, Schema] = {"do": NODE, "machine": MACHINE, "next": to}
    found = {key: {**schema, "description": _STATE[key]} for key, schema in own.items()}
    hooks = schemas_of_keys(modifiers()[ON_ENTER])
    inside = {key: _key_of("node", key) for key in anywhere if key != "name"}
    return {"type": "object", "properties": {**found, **hooks, **inside}, "additionalProperties": False}


def _skill(skill: Skill, about: str) -> Schema:
    """Return the schema of the value of a skill: its main argument, or a map of several."""
    arguments = {
        name: {**_argument(wanted), "description": f"Argument of `{skill.name}`: {wanted.phrase}."}
        for name, wanted in skill.arguments.items()
    }
    single = _argument(skill.arguments[skill.main]) if skill.main else {}
    several = {"type": "object", "properties": arguments, "additionalProperties": False}
    notes = {key: single[key] for key in ("x-names",) if key in single}
    empty = [] if skill.required or skill.entries else [{"type": "null"}]
    word = {**single, "type": [name for name in single.get("type", ()) if name != "object"]}
    return {"anyOf": [*([word] if single else []), several, *empty], "description": about, **notes}


def skills_for(robot: Robot) -> dict[str, tuple[Skill, str]]:
    """Return the skills that missions of a robot may use, each with a description."""
    offered = skills_of(component.type_name for component in robot.components.values())
    return {name: (source.skill, _about(source, offered)) for name, source in usable_skills(robot).items()}


def _about(source: SkillSource, offered: DescribedSkills) -> str:
    name = source.skill.name
    if source.way is SkillWay.PYTHON:
        return f"Skill in Python: {first_line(skill_type(name).make.__doc__)}"
    return offered[name][1] if name in offered else "Skill of this robot."


def skills_of(types: Iterable[str]) -> dict[str, tuple[Skill, str]]:
    """Return the skills that components of these types offer, each with a description."""
    found = {}
    for name in sorted(types):
        cls = component_type(name)
        for skill in _skills(cls):
            found[skill.name] = (skill, f"Skill of `{name}`: {first_line(cls.__doc__)}")
    return found


def _skills(cls: type[Any]) -> Iterator[Skill]:
    for _, port in inspect.getmembers(cls):
        name = port.topic.rsplit("/", 1)[-1] if isinstance(port, ServesAction | ServesTopic) else ""
        if isinstance(port, ServesAction) and port.interface is not None and port.skill is not None:
            yield skill_of(
                port.interface,
                port.skill or name,
                port.claims,
                port.restartable,
                entries=port.entries,
                measures=port.measures,
                choices=port.choices,
                may_lack=port.may_lack,
            )
        if isinstance(port, ServesTopic) and port.interface is not None:
            yield topic_skill(port.interface, name, None, port.claims, port.restartable, entries=port.entries)
