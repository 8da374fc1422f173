"""The names in robots, missions and tests: what is defined, and what is referred to."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cache
from pathlib import Path
from typing import Any

from rbxcompose.base.config import ANYTHING, CONTROLLER, FILE, JOINT, MISSION, PLACE, SERVO_BUS, TOPIC, VALUE
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.parser import parse, parse_fill
from rbxcompose.base.expressions.text import parse_template
from rbxcompose.base.expressions.tree import ExpressionError, Reference
from rbxcompose.base.expressions.types import TypeKind
from rbxcompose.base.findings import Report
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.sections.composition import PART_ARGUMENT, args, include, profiles, provides
from rbxcompose.compiler.sections.missions import INPUT, missions
from rbxcompose.manifest.registry import section_named
from rbxcompose.manifest.section import OVERLAY, PART, ROBOT, TEST, Section
from rbxcompose.manifest.test_file import STEP_KEYS
from rbxcompose.manifest.tree import (
    KeyPath,
    MappingNode,
    ScalarNode,
    SequenceNode,
    TreeNode,
    at,
    entries_of,
    scalars,
    text_at,
)
from rbxcompose.missions.language.grammar import BODIES, STATE_KEYS, Takes
from rbxcompose.missions.language.reader import INTERRUPT_KEYS, read_program
from rbxcompose.missions.program.parts import DEEDS, MACHINE_KEYS, Asked, WrittenArgument
from rbxcompose.missions.program.program import Program, Skill
from rbxcompose.missions.program.registry import keys_taking, kinds, modifier_keys
from rbxcompose.tools.lsp.project import MISSION as MISSION_DOCUMENT
from rbxcompose.tools.lsp.project_files import NO_MEANING, Meanings, NamePiece, ProjectFiles, Symbol

VARIABLE, ITEM, STATE, NODE, BRANCH, INTERRUPT = "variable", "item", "state", "node", "branch", "interrupt"
"""Sorts of names that missions define; those of other manifests are named like the section that defines them."""
_FILL = re.compile(r"\$\$|\$\{(?P<body>[^}]*)\}")
_ARGUMENT = "args."
_UNNAMED = (ANYTHING, FILE, TOPIC, INPUT, PART_ARGUMENT)  # kinds that are looked up elsewhere, or have no names
PLACED = ("place", "pose")  # types whose values are names of places
_NAMED = (Takes.BRANCHES, Takes.CASES, Takes.STATES, Takes.INTERRUPTS)  # maps whose keys people choose
_PLAIN = ("message", "set", "with", "publish", "call", "inputs")  # keys whose values are no steps
_WORDS = (TypeKind.CHOICE, TypeKind.TEXT)  # types whose bare words are no places
TARGETS = (ITEM, STATE, NODE)  # sorts of names that an interrupt may restart
_SORTS = {"for": ITEM, "save": VARIABLE, "name": NODE}
_STEPS = (STATE, NODE, ITEM)


@dataclass(frozen=True, slots=True)
class Mention:
    """A place where the name of a symbol is written, as offsets in the text of a file.

    Both are -1 if escapes or folded lines hide it.
    """

    symbol: Symbol
    file: Path
    start: int
    end: int
    is_definition: bool = False


class _FileMentions:
    """Finds the names in one file, which `robots` have."""

    def __init__(self, files: ProjectFiles, path: Path, robots: Sequence[Path] = ()) -> None:
        self.files, self.path, self.robots = files, path, robots
        self.root = files.tree(path)
        self.names: Mapping[str, list[Symbol]] = {}  # of the mission that it is, or that it is about

    def _mention(self, scalar: ScalarNode, symbol: Symbol, start: int = 0, *, is_definition: bool = False) -> Mention:
        place = self.files.places(self.path).of(scalar, start, start + len(symbol.name))
        return Mention(symbol, self.path, *place, is_definition=is_definition)

    def _meant(
        self, scalar: ScalarNode, start: int, meanings: Meanings, *, is_definition: bool = False
    ) -> Iterator[Mention]:
        """Yield the places of a word, which begins at `start` of a scalar, under each of its meanings."""
        for piece in {piece for meaning in meanings for piece in meaning}:
            place = self.files.places(self.path).of(scalar, start + piece.start, start + piece.end)
            is_own = is_definition and piece.start == 0 and all(len(meaning) == 1 for meaning in meanings)
            yield Mention(piece.symbol, self.path, *place, is_definition=is_own)

    def _own(self, scalar: ScalarNode, sorts: tuple[str, ...]) -> Iterator[Mention]:
        yield from (self._mention(scalar, symbol) for symbol in self.names.get(scalar.text, ()) if symbol.sort in sorts)

    def _of_robots(self, kind: str, scalar: ScalarNode, start: int = 0, word: str = "") -> Iterator[Mention]:
        for robot in self.robots:
            yield from self._meant(scalar, start, self.files.meanings(robot, kind, word or scalar.text))


class ManifestMentions(_FileMentions):
    """Finds the names in a robot, a part or an overlay."""

    def __init__(self, files: ProjectFiles, path: Path) -> None:
        super().__init__(files, path)
        self.scopes = files.scopes(path)

    def all(self) -> Iterator[Mention]:
        """Yield every place where a name is written."""
        yield from self._fills(self.root)
        for layer in self.files.layers(self.path):
            for name, entry in layer.entries.items():
                if (section := section_named(name)) is not None:
                    yield from self._of_section(section, layer, entry.value)

    def _of_section(self, section: Section[Any, Any], layer: MappingNode, node: TreeNode) -> Iterator[Mention]:
        for name, entry in entries_of(at(layer, (section.name, *section.at)) if section.names else None).items():
            for scope in self.scopes:
                meanings = self.files.visible(scope, section.name).get(name, frozenset())
                yield from self._meant(entry.key, 0, meanings, is_definition=True)
        for kind, scalar in references(self.files, self.scopes[0], section, node):
            yield from self._reference(kind, scalar)
        if section.name == include.name:
            yield from self._given_to_parts(node)
        elif section.name == missions.name:
            yield from self._given_to_missions(node)
        elif section.name == args.name:
            yield from self._defaults(node)
        elif section.name == provides.name:
            for scalar in scalars(at(node, ("values",))):
                yield from self._reference(VALUE, scalar)

    def _reference(self, kind: str, scalar: ScalarNode) -> Iterator[Mention]:
        for scope in self.scopes:
            yield from self._meant(scalar, 0, self.files.meanings(scope, kind, scalar.text))

    def _given_to_parts(self, node: TreeNode) -> Iterator[Mention]:
        for instance, entry in entries_of(node).items():
            parts = [part for scope in self.scopes for part in self.files.parts(scope).get(instance, ())]
            for name, given in entries_of(at(entry.value, ("with",))).items():
                for part in parts:
                    own = Symbol(part, args.name, name)
                    if own.name in self.files.visible(part, args.name):
                        yield from self._meant(given.key, 0, frozenset({(NamePiece(0, len(name), own),)}))
                    for kind in kinds_of_argument(self.files, part, name):
                        for scalar in scalars(given.value):
                            yield from self._reference(kind, scalar)

    def _given_to_missions(self, node: TreeNode) -> Iterator[Mention]:
        there = [one for scope in self.scopes for one in self.files.missions(scope)]
        for mission, entry in entries_of(node).items():
            for name, given in entries_of(at(entry.value, ("with",))).items():
                for file in dict.fromkeys(file for one, file in there if one == mission):
                    declared = at(self.files.tree(file), ("inputs", name))
                    if declared is None:
                        continue
                    piece = NamePiece(0, len(name), Symbol(file, VARIABLE, name))
                    yield from self._meant(given.key, 0, frozenset({(piece,)}))
                    if is_placed(declared):
                        for scalar in scalars(given.value):
                            yield from self._reference(PLACE, scalar)

    def _defaults(self, node: TreeNode) -> Iterator[Mention]:
        for name, entry in entries_of(node).items():
            value = at(entry.value, ("default",)) or entry.value
            kinds = {kind for scope in self.scopes for kind in kinds_of_argument(self.files, scope, name)}
            for scalar in scalars(value) if not isinstance(value, MappingNode) else ():
                for kind in kinds:
                    yield from self._reference(kind, scalar)

    def _fills(self, node: TreeNode) -> Iterator[Mention]:
        for scalar in scalars(node):
            for start, name in filled_arguments(scalar.text):
                for scope in self.scopes:
                    if name in self.files.visible(scope, args.name):
                        piece = NamePiece(0, len(name), Symbol(scope, args.name, name))
                        yield from self._meant(scalar, start, frozenset({(piece,)}))


def references(
    files: ProjectFiles, scope: Path, section: Section[Any, Any], node: TreeNode
) -> list[tuple[str, ScalarNode]]:
    """Return the words of a section that name something, each with the kind of thing."""
    found: list[tuple[str, ScalarNode]] = []
    if section.name in (args.name, profiles.name):
        return found  # their values have the kinds of what they fill or change

    def record(kind: str, value: TreeNode) -> TreeNode:
        if kind not in _UNNAMED:
            found.extend((kind, scalar) for scalar in scalars(value))
        return value

    section.with_references(_with_types(files, scope, section, node), record)
    return found


def _with_types(files: ProjectFiles, scope: Path, section: Section[Any, Any], node: TreeNode) -> TreeNode:
    """Return the entries of a section, those without a `type` with that of the entry that they change."""
    if section.models is None or not isinstance(node, MappingNode):
        return node
    changed = {}
    for name, entry in node.entries.items():
        changed[name] = entry
        if isinstance(entry.value, MappingNode) and "type" not in entry.value:
            for pieces in files.visible(scope, section.name).get(name, ()):
                if isinstance(word := files.definition(pieces[-1].symbol, "type"), ScalarNode):
                    entries = {**entry.value.entries, "type": replace(entry, key=word, value=word)}
                    changed[name] = replace(entry, value=replace(entry.value, entries=entries))
    return replace(node, entries=changed)


def kinds_of_argument(files: ProjectFiles, part: Path, name: str, level: int = 0) -> frozenset[str]:
    """Return the kinds of names that an argument holds: by its type, and by the fields that it fills."""
    if level > 4:
        return frozenset()
    found = set()
    filler = f"${{{_ARGUMENT}{name}}}"
    for layer in files.layers(part):
        if is_placed(at(layer, (args.name, name))):
            found.add(PLACE)
        for key, entry in layer.entries.items():
            section = section_named(key)
            if section is not None:
                found |= {kind for kind, node in references(files, part, section, entry.value) if node.text == filler}
        for instance, entry in entries_of(layer.get(include.name)).items():
            for inner, given in entries_of(at(entry.value, ("with",))).items():
                if isinstance(given.value, ScalarNode) and given.value.text == filler:
                    for other in files.parts(part).get(instance, ()):
                        found |= kinds_of_argument(files, other, inner, level + 1)
    return frozenset(found)


def filled_arguments(text: str) -> Iterator[tuple[int, str]]:
    """Yield the names of the arguments in the `${...}` of a text, and where they begin."""
    for match in _FILL.finditer(text) if "${" in text else ():
        try:
            words = parse_fill(match["body"]).words if match["body"] else ()
        except ExpressionError:
            continue
        for word in words:
            if word.name.startswith(_ARGUMENT):
                name = word.name.removeprefix(_ARGUMENT).partition(".")[0]
                yield match.start("body") + word.start + len(_ARGUMENT), name


def is_placed(declared: TreeNode | None) -> bool:
    """Return whether an input or argument takes the name of a place."""
    return text_at(declared, ("type",)) in PLACED


Skills = Mapping[str, Skill]


@dataclass(frozen=True, slots=True)
class StepSurroundings:
    """What the names at a place of a mission may mean: those of the loops and branches around it."""

    path: KeyPath = ()
    items: Mapping[str, Symbol] = field(default_factory=dict)
    are_steps: bool = True

    def below(self, key: str | int, *, are_steps: bool = True) -> StepSurroundings:
        """Return what is around the value of a key."""
        return StepSurroundings((*self.path, key), self.items, self.are_steps and are_steps)


class MissionMentions(_FileMentions):
    """Finds the names in one mission; `skills` are those of a robot that has it, as far as they are known."""

    def __init__(self, files: ProjectFiles, path: Path, skills: Skills) -> None:
        super().__init__(files, path, files.robots_of(path))
        self.skills = skills
        self.names = mission_names(files, path)

    def all(self) -> Iterator[Mention]:
        """Yield every place where a name is written."""
        for section in ("inputs", "data"):
            for name, entry in entries_of(self.root.get(section)).items():
                yield self._mention(entry.key, Symbol(self.path, VARIABLE, name), is_definition=True)
        for key in ("data", "interrupts", "outputs", *BODIES):
            if (node := self.root.get(key)) is not None:
                around = StepSurroundings((key,), are_steps=key not in ("data", "outputs"))
                if key == "machine":
                    yield from self._machine(node, around)
                elif key == "interrupts":
                    yield from self._keys(node, INTERRUPT, ())
                    yield from self._walk_named(node, around)
                else:
                    yield from self._walk(node, around)
        yield from self._places()

    def _keys(self, node: TreeNode | None, sort: str, place: KeyPath) -> Iterator[Mention]:
        for name, entry in entries_of(node).items():
            yield self._mention(entry.key, Symbol(self.path, sort, name, place), is_definition=True)

    def _walk(self, node: TreeNode, around: StepSurroundings) -> Iterator[Mention]:
        if isinstance(node, ScalarNode):
            yield from self._scalar(node, around)
        elif isinstance(node, SequenceNode):
            is_held = around.path[:1] == ("data",)  # steps may be kept in lists of the data
            for index, item in enumerate(node.items):
                inner = around.below(index)
                steps = around.are_steps or (is_held and isinstance(item, MappingNode))
                yield from self._walk(item, StepSurroundings(inner.path, inner.items, steps))
        elif around.are_steps:
            yield from self._step(node, around)
        else:
            for name, entry in node.entries.items():
                yield from self._walk(entry.value, around.below(name, are_steps=False))

    def _walk_named(self, node: TreeNode, around: StepSurroundings) -> Iterator[Mention]:
        for name, entry in entries_of(node).items():
            yield from self._walk(entry.key, around)
            yield from self._walk(entry.value, around.below(name))

    def _step(self, node: MappingNode, around: StepSurroundings) -> Iterator[Mention]:
        around = StepSurroundings(around.path, {**around.items, **self._brought(node, around.path)})
        for key, entry in node.entries.items():
            value, inner = entry.value, around.below(key)
            if key == "for" and isinstance(value, ScalarNode):
                yield self._mention(value, Symbol(self.path, ITEM, value.text, around.path), is_definition=True)
            elif key == "machine":
                yield from self._machine(value, inner)
            elif key in keys_taking(*_NAMED) and isinstance(value, MappingNode):
                yield from self._keys(value, BRANCH, around.path) if key == "parallel" else ()
                yield from self._walk_named(value, inner)
            elif key in _step_words() or key in _PLAIN:
                yield from self._word(key, value, around)
                yield from self._walk(value, around.below(key, are_steps=key not in _PLAIN))
            else:
                yield from self._skill(entry.key, value, inner)

    def _brought(self, node: MappingNode, path: KeyPath) -> dict[str, Symbol]:
        """Return the names that a step gives to those inside it."""
        item, branches = node.get("for"), node.get("parallel")
        found = {}
        if isinstance(item, ScalarNode) and item.text:
            found[item.text] = Symbol(self.path, ITEM, item.text, path)
        for name in branches.entries if isinstance(branches, MappingNode) else ():
            found[name] = Symbol(self.path, BRANCH, name, path)
        return found

    def _word(self, key: str, value: TreeNode, around: StepSurroundings) -> Iterator[Mention]:
        """Yield the name that a word of the language takes."""
        if key == "set":
            for entry in entries_of(value).values():
                yield from self._own(entry.key, (VARIABLE,))
        if not isinstance(value, ScalarNode):
            return
        if key == "save":
            yield self._mention(value, Symbol(self.path, VARIABLE, value.text), is_definition=True)
        elif key == "name":
            yield self._mention(value, Symbol(self.path, NODE, value.text), is_definition=True)
        elif key == "restart":
            yield from self._own(value, TARGETS)
        elif key == "ends_with" and value.text in around.items:
            yield self._mention(value, around.items[value.text])
        elif key == "use":
            yield from self._of_robots(MISSION, value)
            yield from self._given(at(self.root, (*around.path, "with")), value.text)

    def _given(self, given: TreeNode | None, mission: str) -> Iterator[Mention]:
        for name, entry in entries_of(given).items():
            for file in self._files_of(mission):
                if any(symbol.sort == VARIABLE for symbol in mission_names(self.files, file).get(name, ())):
                    yield self._mention(entry.key, Symbol(file, VARIABLE, name))

    def _files_of(self, mission: str) -> set[Path]:
        return {file for robot in self.robots for file in mission_files(self.files, robot, mission)}

    def _skill(self, key: ScalarNode, value: TreeNode, around: StepSurroundings) -> Iterator[Mention]:
        """Yield the names in the call of a skill: a controller is one, and its arguments are its joints."""
        found = list(self._of_robots(CONTROLLER, key))
        yield from found
        for _, argument in entries_of(value).items() if found else ():
            yield from self._of_robots(JOINT, argument.key)
        yield from self._walk(value, around.below("", are_steps=False))

    def _machine(self, node: TreeNode, around: StepSurroundings) -> Iterator[Mention]:
        states = at(node, ("states",))
        yield from self._keys(states, STATE, around.path)
        known = states.entries if isinstance(states, MappingNode) else {}
        targets = [at(node, ("start",))]
        for name, entry in known.items():
            inner = around.below("states").below(name)
            leads = at(entry.value, ("next",))
            targets += list(scalars(leads))
            if isinstance(entry.value, MappingNode):
                yield from self._step(entry.value, inner)
        for target in targets:
            if isinstance(target, ScalarNode) and target.text in known:
                yield self._mention(target, Symbol(self.path, STATE, target.text, around.path))

    def _scalar(self, scalar: ScalarNode, around: StepSurroundings) -> Iterator[Mention]:
        """Yield the `$names` of a text or an expression."""
        for name in dollar_names(scalar.text):
            start = name.start + 1
            if name.name in around.items:
                yield self._mention(scalar, around.items[name.name], start)
            elif own := self.names.get(name.name):
                yield from (self._mention(scalar, symbol, start) for symbol in own if symbol.sort in (VARIABLE, ITEM))
            else:
                yield from self._of_robots(VALUE, scalar, start, name.name)

    def _places(self) -> Iterator[Mention]:
        program = read_program(self.root, Report(), list(self.skills))
        for name in ("inputs", "data"):
            yield from self._known_places(name)
        for _, asked in program.asked() if program else ():
            if asked.wanted.kind not in _WORDS:
                yield from self._words(asked)
        for node in program.nodes if program else ():
            for case in node.step.choice.cases if node.step.choice else ():
                yield from self._words(case)
            types = self._types(program, node.step.uses, node.skill) if program else {}
            for argument in node.step.arguments:
                if types.get(argument.name, TypeKind.PLACE) not in _WORDS:
                    yield from self._argument(argument)

    def _types(self, program: Program, used: ScalarNode | None, skill: str) -> dict[str, TypeKind]:
        """Return the types of the arguments of a skill or mission; the main one has no name."""
        if used is not None:
            inputs = (self.files.tree(file).get("inputs") for file in self._files_of(used.text))
            named = (pair for input_ in inputs for pair in entries_of(input_).items())
            return {name: TypeKind.PLACE if is_placed(entry.value) else TypeKind.TEXT for name, entry in named}
        known = self.skills.get(skill)
        types = {name: argument.kind for name, argument in known.arguments.items()} if known else {}
        return types | ({"": types[known.main]} if known and known.main in types else {})

    def _argument(self, argument: WrittenArgument) -> Iterator[Mention]:
        for scalar in scalars(argument.value):
            for word in words(scalar.text):
                yield from self._of_robots(PLACE, scalar, word.start, word.name)

    def _words(self, asked: Asked) -> Iterator[Mention]:
        for word in asked.expression.words:
            yield from self._of_robots(PLACE, asked.scalar, word.start, word.name)

    def _known_places(self, section: str) -> Iterator[Mention]:
        """Yield the places in the values of inputs and data: a map or list that has nothing else, or a single word."""
        for entry in entries_of(self.root.get(section)).values():
            value: TreeNode | None = entry.value
            if section == "inputs":
                value = at(entry.value, ("default",)) if is_placed(entry.value) else None
            keys = [one.key for _, one in entries_of(value).items()]
            items = list(value.items) if isinstance(value, SequenceNode) else [value]
            for group in (keys, [item for item in items if isinstance(item, ScalarNode)]):
                if group and (not isinstance(value, SequenceNode) or len(group) == len(items)):
                    yield from self._if_all_are_places(group)

    def _if_all_are_places(self, group: list[ScalarNode]) -> Iterator[Mention]:
        for robot in self.robots:
            found = [self.files.meanings(robot, PLACE, node.text) for node in group]
            if NO_MEANING not in found:
                for scalar, meanings in zip(group, found, strict=True):
                    yield from self._meant(scalar, 0, meanings)


def mission_names(files: ProjectFiles, path: Path) -> dict[str, list[Symbol]]:
    """Return the symbols that a mission's file defines, by name."""
    found: dict[str, dict[Symbol, None]] = {}

    def add(sort: str, name: str, place: KeyPath = ()) -> None:
        found.setdefault(name, {})[Symbol(path, sort, name, place)] = None

    def walk(node: TreeNode, place: KeyPath) -> None:
        if isinstance(node, SequenceNode):
            for index, item in enumerate(node.items):
                walk(item, (*place, index))
        elif isinstance(node, MappingNode):
            for key, entry in node.entries.items():
                text = entry.value.text if isinstance(entry.value, ScalarNode) else ""
                if key in _SORTS and text and place:
                    add(_SORTS[key], text, place if key == "for" else ())
                if key == "machine" and isinstance(states := at(entry.value, ("states",)), MappingNode):
                    for name in states.entries:
                        add(STATE, name, (*place, "machine"))
                if key not in _PLAIN:
                    walk(entry.value, (*place, key))

    root = files.tree(path)
    for section in ("inputs", "data"):
        for name in entries_of(root.get(section)):
            add(VARIABLE, name)
    walk(root, ())
    return {name: list(symbols) for name, symbols in found.items()}


def mission_files(files: ProjectFiles, robot: Path, mission: str) -> set[Path]:
    """Return the files of a mission of a robot, by the name that it has there."""
    symbols = {pieces[-1].symbol for pieces in files.meanings(robot, MISSION, mission)}
    return {file for symbol in symbols for name, file in files.missions(symbol.file) if name == symbol.name}


def dollar_names(text: str) -> tuple[Reference, ...]:
    """Return the `$names` of an expression or, if it is none, of a text."""
    if "$" not in text:
        return ()
    try:
        return parse(text).names
    except ExpressionError:
        pass
    try:
        return parse_template(text).names
    except ExpressionError:
        return ()


def words(text: str) -> tuple[Reference, ...]:
    """Return the bare words of an expression; none if it is no expression."""
    try:
        return parse(text).words
    except ExpressionError:
        return ()


@cache
def _step_words() -> frozenset[str]:
    """Return the words of the language in steps: all other keys are names of skills."""
    options = (key for kind in kinds().values() for key in kind.fields)
    own = (*STATE_KEYS, *MACHINE_KEYS, *INTERRUPT_KEYS, *DEEDS, "level", "restart", "name")
    return frozenset((*options, *modifier_keys(), *own))


class TrialMentions(_FileMentions):
    """Finds the names in a test of a robot; `skills` are those of the robot, as far as they are known."""

    def __init__(self, files: ProjectFiles, path: Path, robot: Path, skills: Skills) -> None:
        super().__init__(files, path, (robot,))
        self.skills = skills
        mission = self.root.get("mission")
        self.mission = mission if isinstance(mission, ScalarNode) else None
        missions = mission_files(files, robot, self.mission.text) if self.mission else set()
        names = [mission_names(files, one) for one in missions]
        self.names = {name: [*one[name]] for one in names for name in one}

    def all(self) -> Iterator[Mention]:
        """Yield every place where a name is written."""
        if self.mission is None:
            return
        yield from self._of_robots(MISSION, self.mission)
        for entry in entries_of(self.root.get("with")).values():
            yield from self._own(entry.key, (VARIABLE,))
            yield from self._values(entry.value)
        for entry in entries_of(self.root.get("mocks")).values():
            yield from self._of_robots(CONTROLLER, entry.key)
            yield from self._set(at(entry.value, ("sets",)))
            if self._takes_places(entry.key.text, ""):
                for scalar in scalars(at(entry.value, ("fails_for",))):
                    yield from self._values(scalar)
        events = self.root.get("events")
        for event in events.items if isinstance(events, SequenceNode) else ():
            yield from self._set(at(event, ("set",)))
            for key, kind in (("joint", JOINT), ("bus", SERVO_BUS)):
                if isinstance(word := at(event, ("fault", key)), ScalarNode):
                    yield from self._of_robots(kind, word)
        yield from self._expected()

    def _expected(self) -> Iterator[Mention]:
        for key in ("steps", "never"):
            listed = at(self.root, ("expect", key))
            for item in listed.items if isinstance(listed, SequenceNode) else ():
                yield from self._step(item)
        for entry in entries_of(at(self.root, ("expect", "count"))).values():
            yield from self._own(entry.key, _STEPS)
            yield from self._of_robots(CONTROLLER, entry.key)
        for entry in entries_of(at(self.root, ("expect", "data"))).values():
            yield from self._own(entry.key, (VARIABLE,))
            yield from self._values(entry.value)

    def _step(self, item: TreeNode) -> Iterator[Mention]:
        if isinstance(item, ScalarNode):
            yield from self._own(item, _STEPS)
            yield from self._of_robots(CONTROLLER, item)
        for entry in entries_of(item).values():
            name = entry.key.text
            if name in STEP_KEYS:
                continue
            yield from self._own(entry.key, _STEPS)
            is_controller = list(self._of_robots(CONTROLLER, entry.key))
            yield from is_controller
            for argument in entries_of(entry.value).values():
                yield from self._of_robots(JOINT, argument.key) if is_controller else ()
                if self._takes_places(name, argument.key.text):
                    yield from self._values(argument.value)
            if isinstance(entry.value, ScalarNode) and self._takes_places(name, ""):
                yield from self._values(entry.value)

    def _takes_places(self, skill: str, argument: str) -> bool:
        known = self.skills.get(skill)
        wanted = known.arguments.get(argument or known.main) if known else None
        return wanted is None or wanted.kind not in (TypeKind.TEXT, TypeKind.CHOICE)

    def _set(self, node: TreeNode | None) -> Iterator[Mention]:
        for entry in entries_of(node).values():
            yield from self._of_robots(VALUE, entry.key)
            yield from self._values(entry.value)

    def _values(self, node: TreeNode) -> Iterator[Mention]:
        """Yield the places and `$names` in a value."""
        for scalar in scalars(node):
            for word in words(scalar.text):
                yield from self._of_robots(PLACE, scalar, word.start, word.name)
            for name in dollar_names(scalar.text):
                own = self.names.get(name.name, ())
                yield from (self._mention(scalar, symbol, name.start + 1) for symbol in own if symbol.sort == VARIABLE)
                if not own:
                    yield from self._of_robots(VALUE, scalar, name.start + 1, name.name)


MentionPlace = tuple[Path, int, int]


class SymbolIndex:
    """All mentions of names in the manifests of a project.

    `robot_of` returns the robot of a file as last read, if it could be: a mission does not say which arguments of
    skills are places.
    """

    def __init__(self, files: ProjectFiles, robot_of: Callable[[Path], Robot | None]) -> None:
        self.files = files
        self._robot_of = cache(robot_of)
        self.mentions = list(dict.fromkeys(one for path in files.all for one in self._of(path)))
        self._of_symbol: dict[Symbol, list[Mention]] = {}
        self._at: dict[MentionPlace, list[Mention]] = {}
        for mention in self.mentions:
            self._of_symbol.setdefault(mention.symbol, []).append(mention)
            if mention.start >= 0:
                self._at.setdefault((mention.file, mention.start, mention.end), []).append(mention)

    def _of(self, path: Path) -> Iterator[Mention]:
        kind = self.files.kind(path)
        if kind in (ROBOT, PART, OVERLAY):
            yield from ManifestMentions(self.files, path).all()
        elif kind == MISSION_DOCUMENT:
            yield from MissionMentions(self.files, path, self._skills(self.files.robots_of(path))).all()
        elif kind == TEST and (robot := self.files.file_named(path, "robot")) is not None:
            yield from TrialMentions(self.files, path, robot, self._skills([robot])).all()

    def _skills(self, robots: Iterable[Path]) -> Skills:
        found = (self._robot_of(robot) for robot in robots)
        return {name: skill for robot in found if robot for name, skill in robot.names.skills.items()}

    @property
    def symbols(self) -> list[Symbol]:
        """Return all names of the project."""
        return list(self._of_symbol)

    def at(self, path: Path, line: int, column: int) -> list[Mention]:
        """Return the mentions at a position (from 0); several if the name there has several meanings."""
        offset = self.files.places(path).offset(line, column)
        here = (mention for mention in self.mentions if mention.file == path)
        found = [mention for mention in here if mention.start <= offset <= mention.end]
        # Between two names, as at the end of the one of an instance, the one that begins there is meant.
        inside = [mention for mention in found if mention.start <= offset < mention.end] or found
        nearest = max((item.start for item in inside), default=0)
        return [item for item in inside if item.start == nearest]

    def of(self, symbol: Symbol) -> list[Mention]:
        """Return all places where the name of a symbol is written."""
        return self._of_symbol.get(symbol, [])

    def together(self, symbols: list[Symbol]) -> dict[Symbol, None]:
        """Return symbols with all that share a place with one of them: robots that share a mission, for example."""
        found, waiting = dict.fromkeys(symbols), list(symbols)
        while waiting:
            for mention in self.of(waiting.pop()):
                for other in self._at.get((mention.file, mention.start, mention.end), ()):
                    if other.symbol not in found:
                        found[other.symbol] = None
                        waiting.append(other.symbol)
        return found


def symbol_index_references(
    index: SymbolIndex, path: Path, line: int, column: int, *, with_definitions: bool
) -> list[Mention]:
    """Return where the name at a position (from 0) is written, in all files of the project."""
    symbols = dict.fromkeys(mention.symbol for mention in index.at(path, line, column))
    found = (mention for symbol in symbols for mention in index.of(symbol))
    places = {
        (mention.file, mention.start, mention.end): mention
        for mention in found
        if mention.start >= 0 and (with_definitions or not mention.is_definition)
    }
    return [places[key] for key in sorted(places)]
