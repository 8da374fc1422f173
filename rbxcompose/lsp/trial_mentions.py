"""The names in a test of a mission: those of its robot and of the mission that it tests."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from rbxcompose.expressions.types import TypeKind
from rbxcompose.lsp.manifest_mentions import leaves, mentions
from rbxcompose.lsp.mission_mentions import Skills, dollar_names, mission_files, mission_names, words
from rbxcompose.lsp.project_files import ProjectFiles
from rbxcompose.lsp.symbols import ITEM, NODE, STATE, VARIABLE, Mention, Symbol
from rbxcompose.manifest.test_file import STEP_KEYS
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode, at
from rbxcompose.references import CONTROLLER, JOINT, MISSION, PLACE, SERVO_BUS, VALUE

_STEPS = (STATE, NODE, ITEM)


class TrialMentions:
    """Finds the names in one test; `skills` are those of its robot, as far as they are known."""

    def __init__(self, files: ProjectFiles, path: Path, skills: Skills) -> None:
        self.files, self.path, self.skills = files, path, skills
        self.root = files.tree(path)
        self.robot = files.file_named(path, "robot")
        mission = self.root.get("mission")
        self.mission = mission if isinstance(mission, ScalarNode) else None
        self.missions = mission_files(files, self.robot, self.mission.text) if self.robot and self.mission else set()
        names = [mission_names(files, one) for one in self.missions]
        self.names = {name: [*one[name]] for one in names for name in one}

    def all(self) -> Iterator[Mention]:
        """Yield every place where a name is written."""
        if self.robot is None or self.mission is None:
            return
        yield from self._of_robot(MISSION, self.mission)
        for entry in _entries(self.root.get("with")):
            yield from self._own(entry.key, (VARIABLE,))
            yield from self._values(entry.value)
        for entry in _entries(self.root.get("mocks")):
            yield from self._of_robot(CONTROLLER, entry.key)
            yield from self._set(at(entry.value, ("sets",)))
            if self._takes_places(entry.key.text, ""):
                for scalar in leaves(at(entry.value, ("fails_for",))):
                    yield from self._values(scalar)
        events = self.root.get("events")
        for event in events.items if isinstance(events, SequenceNode) else ():
            yield from self._set(at(event, ("set",)))
            for key, kind in (("joint", JOINT), ("bus", SERVO_BUS)):
                if isinstance(word := at(event, ("fault", key)), ScalarNode):
                    yield from self._of_robot(kind, word)
        yield from self._expected()

    def _expected(self) -> Iterator[Mention]:
        for key in ("steps", "never"):
            listed = at(self.root, ("expect", key))
            for item in listed.items if isinstance(listed, SequenceNode) else ():
                yield from self._step(item)
        for entry in _entries(at(self.root, ("expect", "count"))):
            yield from self._own(entry.key, _STEPS)
            yield from self._of_robot(CONTROLLER, entry.key)
        for entry in _entries(at(self.root, ("expect", "data"))):
            yield from self._own(entry.key, (VARIABLE,))
            yield from self._values(entry.value)

    def _step(self, item: TreeNode) -> Iterator[Mention]:
        if isinstance(item, ScalarNode):
            yield from self._own(item, _STEPS)
            yield from self._of_robot(CONTROLLER, item)
        for entry in _entries(item):
            name = entry.key.text
            if name in STEP_KEYS:
                continue
            yield from self._own(entry.key, _STEPS)
            is_controller = list(self._of_robot(CONTROLLER, entry.key))
            yield from is_controller
            for argument in _entries(entry.value):
                yield from self._of_robot(JOINT, argument.key) if is_controller else ()
                if self._takes_places(name, argument.key.text):
                    yield from self._values(argument.value)
            if isinstance(entry.value, ScalarNode) and self._takes_places(name, ""):
                yield from self._values(entry.value)

    def _takes_places(self, skill: str, argument: str) -> bool:
        known = self.skills.get(skill)
        wanted = known.arguments.get(argument or known.main) if known else None
        return wanted is None or wanted.kind not in (TypeKind.TEXT, TypeKind.CHOICE)

    def _set(self, node: TreeNode | None) -> Iterator[Mention]:
        for entry in _entries(node):
            yield from self._of_robot(VALUE, entry.key)
            yield from self._values(entry.value)

    def _values(self, node: TreeNode) -> Iterator[Mention]:
        """Yield the places and `$names` in a value."""
        for scalar in leaves(node):
            for word in words(scalar.text):
                yield from self._of_robot(PLACE, scalar, word.start, word.name)
            for name in dollar_names(scalar.text):
                own = self.names.get(name.name, ())
                yield from (self._mention(scalar, one, name.start + 1) for one in own if one.sort == VARIABLE)
                if not own:
                    yield from self._of_robot(VALUE, scalar, name.start + 1, name.name)

    def _own(self, scalar: ScalarNode, sorts: tuple[str, ...]) -> Iterator[Mention]:
        yield from (self._mention(scalar, one) for one in self.names.get(scalar.text, ()) if one.sort in sorts)

    def _mention(self, scalar: ScalarNode, symbol: Symbol, start: int = 0) -> Mention:
        return Mention(symbol, self.path, *self.files.places(self.path).of(scalar, start, start + len(symbol.name)))

    def _of_robot(self, kind: str, scalar: ScalarNode, start: int = 0, word: str = "") -> Iterator[Mention]:
        if self.robot is not None:
            meanings = self.files.meanings(self.robot, kind, word or scalar.text)
            yield from mentions(self.files, self.path, scalar, start, meanings)


def _entries(node: TreeNode | None) -> list[Entry]:
    return list(node.entries.values()) if isinstance(node, MappingNode) else []
