"""The names in a mission: what it defines, what it reads with `$`, and the robot's names in it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from functools import cache
from pathlib import Path

from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.parser import parse
from rbxcompose.expressions.text import parse_template
from rbxcompose.expressions.tree import ExpressionError, Reference
from rbxcompose.expressions.types import TypeKind
from rbxcompose.findings import Report
from rbxcompose.lsp.manifest_mentions import is_placed, leaves, mentions
from rbxcompose.lsp.project_files import NO_MEANING, Meanings, ProjectFiles
from rbxcompose.lsp.symbols import BRANCH, INTERRUPT, ITEM, NODE, STATE, VARIABLE, Mention, Symbol
from rbxcompose.manifest.tree import KeyPath, MappingNode, ScalarNode, SequenceNode, TreeNode, at
from rbxcompose.missions.language.asked import Asked, WrittenArgument
from rbxcompose.missions.language.grammar import Takes
from rbxcompose.missions.language.keys import keys_taking
from rbxcompose.missions.language.machine_reader import STATE_KEYS
from rbxcompose.missions.language.reader import BODIES, INTERRUPT_KEYS, read_program
from rbxcompose.missions.modifiers.registry import modifier_keys
from rbxcompose.missions.program.machines import MACHINE_KEYS
from rbxcompose.missions.program.moments import DEEDS
from rbxcompose.missions.program.program import Program, Skill
from rbxcompose.missions.program.registry import kinds
from rbxcompose.references import CONTROLLER, JOINT, MISSION, PLACE, VALUE

Skills = Mapping[str, Skill]
_NAMED = (Takes.BRANCHES, Takes.CASES, Takes.STATES, Takes.INTERRUPTS)  # maps whose keys people choose
_PLAIN = ("message", "set", "with", "publish", "call", "inputs")  # keys whose values are no steps
_WORDS = (TypeKind.CHOICE, TypeKind.TEXT)  # types whose bare words are no places


@dataclass(frozen=True, slots=True)
class StepSurroundings:
    """What the names at a place of a mission may mean: those of the loops and branches around it."""

    path: KeyPath = ()
    items: Mapping[str, Symbol] = field(default_factory=dict)
    are_steps: bool = True

    def below(self, key: str | int, *, are_steps: bool = True) -> StepSurroundings:
        """Return what is around the value of a key."""
        return StepSurroundings((*self.path, key), self.items, self.are_steps and are_steps)


class MissionMentions:
    """Finds the names in one mission; `skills` are those of a robot that has it, as far as they are known."""

    def __init__(self, files: ProjectFiles, path: Path, skills: Skills) -> None:
        self.files, self.path, self.skills = files, path, skills
        self.root = files.tree(path)
        self.robots = files.robots_of(path)
        self.names = mission_names(files, path)

    def all(self) -> Iterator[Mention]:
        """Yield every place where a name is written."""
        for section in ("inputs", "data"):
            named = self.root.get(section)
            for name, entry in named.entries.items() if isinstance(named, MappingNode) else ():
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

    def _mention(self, scalar: ScalarNode, symbol: Symbol, start: int = 0, *, is_definition: bool = False) -> Mention:
        place = self.files.places(self.path).of(scalar, start, start + len(symbol.name))
        return Mention(symbol, self.path, *place, is_definition=is_definition)

    def _of_robot(self, kind: str, scalar: ScalarNode, start: int, word: str) -> Iterator[Mention]:
        for robot in self.robots:
            yield from mentions(self.files, self.path, scalar, start, self.files.meanings(robot, kind, word))

    def _keys(self, node: TreeNode | None, sort: str, place: KeyPath) -> Iterator[Mention]:
        for name, entry in node.entries.items() if isinstance(node, MappingNode) else ():
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
        for name, entry in node.entries.items() if isinstance(node, MappingNode) else ():
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
        if key == "set" and isinstance(value, MappingNode):
            for name, entry in value.entries.items():
                yield from (self._mention(entry.key, one) for one in self.names.get(name, ()) if one.sort == VARIABLE)
        if not isinstance(value, ScalarNode):
            return
        if key == "save":
            yield self._mention(value, Symbol(self.path, VARIABLE, value.text), is_definition=True)
        elif key == "name":
            yield self._mention(value, Symbol(self.path, NODE, value.text), is_definition=True)
        elif key == "restart":
            yield from (self._mention(value, one) for one in self.names.get(value.text, ()) if one.sort in TARGETS)
        elif key == "ends_with" and value.text in around.items:
            yield self._mention(value, around.items[value.text])
        elif key == "use":
            yield from self._of_robot(MISSION, value, 0, value.text)
            yield from self._given(at(self.root, (*around.path, "with")), value.text)

    def _given(self, given: TreeNode | None, mission: str) -> Iterator[Mention]:
        for name, entry in given.entries.items() if isinstance(given, MappingNode) else ():
            for file in self._files_of(mission):
                if any(one.sort == VARIABLE for one in mission_names(self.files, file).get(name, ())):
                    yield self._mention(entry.key, Symbol(file, VARIABLE, name))

    def _files_of(self, mission: str) -> set[Path]:
        return {file for robot in self.robots for file in mission_files(self.files, robot, mission)}

    def _skill(self, key: ScalarNode, value: TreeNode, around: StepSurroundings) -> Iterator[Mention]:
        """Yield the names in the call of a skill: a controller is one, and its arguments are its joints."""
        found = list(self._of_robot(CONTROLLER, key, 0, key.text))
        yield from found
        for argument in value.entries.values() if found and isinstance(value, MappingNode) else ():
            yield from self._of_robot(JOINT, argument.key, 0, argument.key.text)
        yield from self._walk(value, around.below("", are_steps=False))

    def _machine(self, node: TreeNode, around: StepSurroundings) -> Iterator[Mention]:
        states = at(node, ("states",))
        yield from self._keys(states, STATE, around.path)
        known = states.entries if isinstance(states, MappingNode) else {}
        targets = [at(node, ("start",))]
        for name, entry in known.items():
            inner = around.below("states").below(name)
            leads = at(entry.value, ("next",))
            targets += list(leaves(leads))
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
                yield from (self._mention(scalar, one, start) for one in own if one.sort in (VARIABLE, ITEM))
            else:
                yield from self._of_robot(VALUE, scalar, start, name.name)

    def _places(self) -> Iterator[Mention]:
        program = read_program(self.root, Report(), list(self.skills))
        for name in ("inputs", "data"):
            yield from self._known_places(name)
        for _, asked in program.asked() if program else ():
            if asked.wanted.kind not in _WORDS:
                yield from self._words(asked)
        for node in program.nodes if program else ():
            for one in node.step.choice.cases if node.step.choice else ():
                yield from self._words(one)
            types = self._types(program, node.step.uses, node.skill) if program else {}
            for argument in node.step.arguments:
                if types.get(argument.name, TypeKind.PLACE) not in _WORDS:
                    yield from self._argument(argument)

    def _types(self, program: Program, used: ScalarNode | None, skill: str) -> dict[str, TypeKind]:
        """Return the types of the arguments of a skill or mission; the main one has no name."""
        if used is not None:
            inputs = (self.files.tree(file).get("inputs") for file in self._files_of(used.text))
            named = [entry for one in inputs if isinstance(one, MappingNode) for entry in one.entries.values()]
            return {one.key.text: TypeKind.PLACE if is_placed(one.value) else TypeKind.TEXT for one in named}
        known = self.skills.get(skill)
        types = {name: one.kind for name, one in known.arguments.items()} if known else {}
        return types | ({"": types[known.main]} if known and known.main in types else {})

    def _argument(self, argument: WrittenArgument) -> Iterator[Mention]:
        for scalar in leaves(argument.value):
            for word in words(scalar.text):
                yield from self._of_robot(PLACE, scalar, word.start, word.name)

    def _words(self, asked: Asked) -> Iterator[Mention]:
        for word in asked.expression.words:
            yield from self._of_robot(PLACE, asked.scalar, word.start, word.name)

    def _known_places(self, section: str) -> Iterator[Mention]:
        """Yield the places in the values of inputs and data: a map or list that has nothing else, or a single word."""
        named = self.root.get(section)
        for entry in named.entries.values() if isinstance(named, MappingNode) else ():
            value: TreeNode | None = entry.value
            if section == "inputs":
                value = at(entry.value, ("default",)) if is_placed(entry.value) else None
            keys = [one.key for one in value.entries.values()] if isinstance(value, MappingNode) else []
            items = list(value.items) if isinstance(value, SequenceNode) else [value]
            for group in (keys, [one for one in items if isinstance(one, ScalarNode)]):
                if group and (not isinstance(value, SequenceNode) or len(group) == len(items)):
                    yield from self._if_all_are_places(group)

    def _if_all_are_places(self, group: list[ScalarNode]) -> Iterator[Mention]:
        for robot in self.robots:
            found: list[tuple[ScalarNode, Meanings]] = [
                (one, self.files.meanings(robot, PLACE, one.text)) for one in group
            ]
            if all(meanings != NO_MEANING for _, meanings in found):
                for scalar, meanings in found:
                    yield from mentions(self.files, self.path, scalar, 0, meanings)


TARGETS = (ITEM, STATE, NODE)  # sorts of names that an interrupt may restart


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
        named = root.get(section)
        for name in named.entries if isinstance(named, MappingNode) else ():
            add(VARIABLE, name)
    walk(root, ())
    return {name: list(symbols) for name, symbols in found.items()}


_SORTS = {"for": ITEM, "save": VARIABLE, "name": NODE}


def mission_files(files: ProjectFiles, robot: Path, mission: str) -> set[Path]:
    """Return the files of a mission of a robot, by the name that it has there."""
    symbols = {pieces[-1].symbol for pieces in files.meanings(robot, MISSION, mission)}
    return {file for one in symbols for name, file in files.missions(one.file) if name == one.name}


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
