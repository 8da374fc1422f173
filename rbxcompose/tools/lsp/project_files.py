"""The manifests of a project as they are written, and the names that each of them sees.

Nothing is composed here: a rename changes what is written, so that each name must lead to where it stands. What a part
brings has the name of its instance in front, and both are names of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from pathlib import Path

from rbxcompose.base.config import COMPONENT, JOINT, LINK, PORT, PREFIXED, RUNNING
from rbxcompose.base.dataclass import dataclass
from rbxcompose.compiler.sections.composition import include, profiles
from rbxcompose.compiler.sections.missions import missions
from rbxcompose.manifest.files import ROBOT_FILE, project_of, resolve
from rbxcompose.manifest.registry import naming, section_named, sections
from rbxcompose.manifest.section import OVERLAY, PART, ROBOT
from rbxcompose.manifest.tree import NOWHERE, KeyPath, MappingNode, ScalarNode, TreeNode, at, entries_of
from rbxcompose.tools.lsp.document import quick_tree
from rbxcompose.tools.lsp.project import kind_of


@dataclass(frozen=True, slots=True)
class Symbol:
    """A name, by the file that defines it and its sort; `at` is the place that bounds it, if that is not the file."""

    file: Path
    sort: str
    name: str
    at: KeyPath = ()


@dataclass(frozen=True, slots=True)
class NamePiece:
    """A part of a word that is the name of a symbol: in `drive_battery`, an instance and a component of its part."""

    start: int
    end: int
    symbol: Symbol

    def shifted(self, offset: int) -> NamePiece:
        """Return the piece in a word that begins `offset` characters earlier."""
        return NamePiece(self.start + offset, self.end + offset, self.symbol)


class ScalarPlaces:
    """Finds the places of scalars in a text."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._starts = [0]
        for line in text.split("\n"):
            self._starts.append(self._starts[-1] + len(line) + 1)

    def offset(self, line: int, column: int) -> int:
        """Return the offset of a position (from 0)."""
        return self._starts[min(line, len(self._starts) - 1)] + column

    def position(self, offset: int) -> tuple[int, int]:
        """Return the line and column (from 0) of an offset."""
        line = self.text.count("\n", 0, offset)
        return line, offset - self._starts[line]

    def of(self, scalar: ScalarNode, start: int, end: int) -> tuple[int, int]:
        """Return the offsets of `scalar.text[start:end]`; (-1, -1) if escapes or folded lines hide it."""
        span = scalar.span
        first = self.offset(span.line - 1, span.column - 1)
        raw = self.text[first : self.offset(span.end_line - 1, span.end_column - 1)]
        word = scalar.text[start:end]
        before, there = _finds(scalar.text, word), _finds(raw, word)
        # The same word in the same order: what YAML changes between the two is none of it.
        if len(before) != len(there) or start not in before:
            return -1, -1
        at = first + there[before.index(start)]
        return at, at + len(word)


def _finds(text: str, word: str) -> list[int]:
    found, at = [], text.find(word)
    while word and at >= 0:
        found.append(at)
        at = text.find(word, at + 1)
    return found


FOLDERS = ("robots", "parts", "missions")  # of a project, where its manifests are
_MOST_FILES = 1000
_MOST_LEVELS = 8  # of parts in parts

Meanings = frozenset[tuple[NamePiece, ...]]
NO_MEANING: Meanings = frozenset()


class ProjectFiles:
    """The manifests of the project around a file; `text` returns the newest text of each."""

    def __init__(self, path: Path, text: Callable[[Path], str]) -> None:
        self.root = project_of(path)
        self._text = text
        self._texts: dict[Path, str] = {}
        self._trees: dict[Path, MappingNode] = {}
        self._places: dict[Path, ScalarPlaces] = {}
        self._visible: dict[tuple[Path, str], dict[str, Meanings]] = {}
        self._parts: dict[Path, dict[str, tuple[Path, ...]]] = {}
        self._missions: dict[Path, tuple[tuple[str, Path], ...]] = {}
        self._opened = path

    def changed(self, texts: Mapping[Path, str]) -> ProjectFiles:
        """Return the same project with other texts."""
        return ProjectFiles(self._opened, lambda path: texts[path] if path in texts else self.text(path))

    def text(self, path: Path) -> str:
        """Return the text of a file."""
        if path not in self._texts:
            self._texts[path] = self._text(path)
        return self._texts[path]

    def tree(self, path: Path) -> MappingNode:
        """Return the tree of a file; an empty one if it cannot be read."""
        if path not in self._trees:
            tree = quick_tree(self.text(path))
            self._trees[path] = tree if isinstance(tree, MappingNode) else MappingNode()
        return self._trees[path]

    def places(self, path: Path) -> ScalarPlaces:
        """Return the places in the text of a file."""
        if path not in self._places:
            self._places[path] = ScalarPlaces(self.text(path))
        return self._places[path]

    def kind(self, path: Path) -> str:
        """Return the kind of manifest that a file is."""
        return kind_of(self.text(path))

    def is_own(self, path: Path) -> bool:
        """Return whether a file belongs to the project, so that it may be changed."""
        return path.is_relative_to(self.root)

    @cached_property
    def all(self) -> tuple[Path, ...]:
        """Return all manifests, with those that they name."""
        found = dict.fromkeys([self._opened, *_written_in(self.root)])
        waiting = list(found)
        while waiting:
            path = waiting.pop()
            for named in self._named_by(path):
                if named not in found:
                    found[named] = None
                    waiting.append(named)
        return tuple(path for path in found if self.kind(path))

    def of_kind(self, *kinds: str) -> Iterator[Path]:
        """Yield the manifests of some kinds."""
        return (path for path in self.all if self.kind(path) in kinds)

    def _named_by(self, path: Path) -> Iterator[Path]:
        if self.kind(path) in (ROBOT, PART, OVERLAY):
            yield from (part for parts in self.parts(path).values() for part in parts)
            yield from (file for _, file in self.missions(path))

    def layers(self, path: Path) -> Iterator[MappingNode]:
        """Yield the maps of a file that have sections: the file itself, and its profiles."""
        root = self.tree(path)
        yield root
        for entry in entries_of(root.get(profiles.name)).values():
            if isinstance(entry.value, MappingNode):
                yield entry.value

    def scopes(self, path: Path) -> tuple[Path, ...]:
        """Return the files whose names a robot, part or overlay sees: itself, or the robot that it is laid over."""
        beside = path.parent / ROBOT_FILE
        return (beside,) if self.kind(path) == OVERLAY and beside.is_file() else (path,)

    def _all_layers(self, scope: Path) -> Iterator[MappingNode]:
        yield from self.layers(scope)
        if self.kind(scope) == ROBOT and scope.name == ROBOT_FILE:
            for path in sorted(scope.parent.glob("*.yaml")):
                if path != scope and self.kind(path) == OVERLAY:
                    yield from self.layers(path)

    def parts(self, scope: Path) -> dict[str, tuple[Path, ...]]:
        """Return the files of the parts that a file includes, by instance; profiles may give one another part."""
        if scope in self._parts:
            return self._parts[scope]
        found: dict[str, dict[Path, None]] = {}
        for layer in self._all_layers(scope):
            for name, entry in entries_of(layer.get(include.name)).items():
                file = self._file(at(entry.value, ("part",)) or entry.value, scope)
                if file is not None and file != scope:
                    found.setdefault(name, {})[file] = None
        self._parts[scope] = {name: tuple(files) for name, files in found.items()}
        return self._parts[scope]

    def missions(self, scope: Path) -> tuple[tuple[str, Path], ...]:
        """Return the missions that a file lists, with their files."""
        if scope not in self._missions:
            self._missions[scope] = tuple(self._listed(scope))
        return self._missions[scope]

    def _listed(self, scope: Path) -> Iterator[tuple[str, Path]]:
        for layer in self._all_layers(scope):
            for name, entry in entries_of(layer.get(missions.name)).items():
                if (file := self._file(at(entry.value, ("file",)) or entry.value, scope)) is not None:
                    yield name, file

    def _file(self, node: TreeNode, writer: Path) -> Path | None:
        if not isinstance(node, ScalarNode) or not node.text or "${" in node.text:
            return None
        found = resolve(node.text, writer, NOWHERE, may_be_robot=True)
        return found if isinstance(found, Path) else None

    def file_named(self, path: Path, key: str) -> Path | None:
        """Return the file that a key of a manifest names."""
        node = self.tree(path).get(key)
        return self._file(node, path) if node is not None else None

    def within(self, scope: Path, level: int = 0) -> Iterator[Path]:
        """Yield a file and all parts that it is made of."""
        yield scope
        if level < _MOST_LEVELS:
            for parts in self.parts(scope).values():
                for part in parts:
                    yield from self.within(part, level + 1)

    @cached_property
    def _robots_of(self) -> dict[Path, tuple[Path, ...]]:
        found: dict[Path, dict[Path, None]] = {}
        for robot in self.of_kind(ROBOT):
            for path in self.within(robot):
                for _, mission in self.missions(path):
                    found.setdefault(mission, {})[robot] = None
        return {mission: tuple(robots) for mission, robots in found.items()}

    def robots_of(self, mission: Path) -> tuple[Path, ...]:
        """Return the robots that have a mission, by its file."""
        return self._robots_of.get(mission, ())

    @cached_property
    def _includers(self) -> dict[Path, tuple[Path, ...]]:
        found: dict[Path, dict[Path, None]] = {}
        for scope in self.of_kind(ROBOT, PART):
            for parts in self.parts(scope).values():
                for part in parts:
                    found.setdefault(part, {})[scope] = None
        return {part: tuple(scopes) for part, scopes in found.items()}

    def visible(self, scope: Path, section_name: str, level: int = 0) -> dict[str, Meanings]:
        """Return the names of a section that a file sees: its own, and those of its parts with their prefixes."""
        key = (scope, section_name)
        if key not in self._visible:
            self._visible[key] = {}  # a circle of parts has no more names
            self._visible[key] = self._names(scope, section_name, level)
        return self._visible[key]

    def _names(self, scope: Path, section_name: str, level: int) -> dict[str, Meanings]:
        section = section_named(section_name)
        if section is None or level > _MOST_LEVELS:
            return {}
        found: dict[str, Meanings] = {}
        for instance, parts in self.parts(scope).items() if section.is_composed else ():
            first = NamePiece(0, len(instance), Symbol(scope, include.name, instance))
            for part in parts:
                for name, meanings in self.visible(part, section_name, level + 1).items():
                    shift = len(instance) + 1
                    new = {(first, *(piece.shifted(shift) for piece in meaning)) for meaning in meanings}
                    word = name if section.has_topics else f"{instance}_{name}"
                    found[word] = found.get(word, NO_MEANING) | (meanings if section.has_topics else new)
        for name in (name for layer in self._all_layers(scope) for name in section.names_in(layer)):
            if name not in found or section.has_topics:
                own = (NamePiece(0, len(name), Symbol(scope, section_name, name)),)
                found[name] = found.get(name, NO_MEANING) | {own}
        return found

    def meanings(self, scope: Path, kind: str, word: str, level: int = 0) -> Meanings:
        """Return what a word means where a file takes a name of a kind.

        What a part lacks belongs to the files that include it.
        """
        if kind in PREFIXED:
            prefix, named = PREFIXED[kind]
            inner = self.meanings(scope, named, word.removeprefix(prefix)) if word.startswith(prefix) else NO_MEANING
            return frozenset(tuple(piece.shifted(len(prefix)) for piece in meaning) for meaning in inner)
        if kind in (LINK, JOINT):
            return self._of_body(scope, kind, word)
        head = word.partition(".")[0] if kind in (PORT, COMPONENT) else word
        found = NO_MEANING
        for section in naming(COMPONENT if kind in (PORT, RUNNING) else kind):
            found |= self.visible(scope, section.name).get(head, NO_MEANING)
        if kind == RUNNING and not found:
            found = self._of_pattern(scope, word)
        if not found and self.kind(scope) == PART and level < _MOST_LEVELS:
            for above in self._includers.get(scope, ()):
                found |= self.meanings(above, kind, word, level + 1)
        return found

    def _of_pattern(self, scope: Path, word: str) -> Meanings:
        """Return the instance of a part that a pattern such as `drive_*` means."""
        instance, star, rest = word.partition("_*")
        if not star or rest or instance not in self.parts(scope):
            return NO_MEANING
        return frozenset({(NamePiece(0, len(instance), Symbol(scope, include.name, instance)),)})

    def _of_body(self, scope: Path, kind: str, word: str) -> Meanings:
        """Return the instances in the name of a link or joint; the rest stands in the body's own file."""
        found = set()
        for instance, parts in self.parts(scope).items():
            if not word.startswith(f"{instance}_") or not any(self._has_body(part, kind) for part in parts):
                continue
            first, shift = NamePiece(0, len(instance), Symbol(scope, include.name, instance)), len(instance) + 1
            inner = {pieces for part in parts for pieces in self._of_body(part, kind, word[shift:])} or {()}
            found |= {(first, *(piece.shifted(shift) for piece in pieces)) for pieces in inner}
        return frozenset(found)

    def _has_body(self, part: Path, kind: str) -> bool:
        names = [section.name for section in sections() if kind in section.defines]
        return any(name in layer for file in self.within(part) for layer in self.layers(file) for name in names)

    def definition(self, symbol: Symbol, key: str) -> TreeNode | None:
        """Return what a key of an entry has where the entry is defined."""
        section = section_named(symbol.sort)
        if section is None:
            return None
        place = (section.name, *section.at, symbol.name, key)
        return next((node for layer in self._all_layers(symbol.file) if (node := at(layer, place)) is not None), None)


def _written_in(root: Path) -> Iterator[Path]:
    """Yield the YAML files of a project's folders; of one without these, those beside each other."""
    folders = [root / name for name in FOLDERS if (root / name).is_dir()]
    found = (path for folder in folders for path in sorted(folder.rglob("*.yaml")))
    files = found if any(folder.name in ("robots", "missions") for folder in folders) else sorted(root.glob("*.yaml"))
    for number, path in enumerate(files):
        if number >= _MOST_FILES:
            return
        yield path.resolve()
