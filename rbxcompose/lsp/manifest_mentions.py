"""The names in a robot, part or overlay: those it defines, those it refers to, and arguments in `${...}`."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from rbxcompose.expressions.parser import parse_fill
from rbxcompose.expressions.tree import ExpressionError
from rbxcompose.lsp.project_files import Meanings, ProjectFiles
from rbxcompose.lsp.symbols import VARIABLE, Mention, NamePiece, Symbol
from rbxcompose.manifest.registry import section_named
from rbxcompose.manifest.section import Section
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode, at, children
from rbxcompose.references import ANYTHING, FILE, PLACE, TOPIC, VALUE
from rbxcompose.sections.args import args
from rbxcompose.sections.include import PART_ARGUMENT, include
from rbxcompose.sections.missions import INPUT, missions
from rbxcompose.sections.profiles import profiles
from rbxcompose.sections.provides import provides

_FILL = re.compile(r"\$\$|\$\{(?P<body>[^}]*)\}")
_ARGUMENT = "args."
_UNNAMED = (ANYTHING, FILE, TOPIC, INPUT, PART_ARGUMENT)  # kinds that are looked up elsewhere, or have no names
PLACED = ("place", "pose")  # types whose values are names of places


class ManifestMentions:
    """Finds the names in one file."""

    def __init__(self, files: ProjectFiles, path: Path) -> None:
        self.files, self.path = files, path
        self.scopes = files.scopes(path)

    def all(self) -> Iterator[Mention]:
        """Yield every place where a name is written."""
        yield from self._fills(self.files.tree(self.path))
        for layer in self.files.layers(self.path):
            for name, entry in layer.entries.items():
                if (section := section_named(name)) is not None:
                    yield from self._of_section(section, layer, entry.value)

    def _of_section(self, section: Section[Any, Any], layer: MappingNode, node: TreeNode) -> Iterator[Mention]:
        named = at(layer, (section.name, *section.at)) if section.names else None
        for name, entry in named.entries.items() if isinstance(named, MappingNode) else ():
            for scope in self.scopes:
                meanings = self.files.visible(scope, section.name).get(name, frozenset())
                yield from self._mentions(entry.key, 0, meanings, is_definition=True)
        for kind, scalar in references(self.files, self.scopes[0], section, node):
            yield from self._reference(kind, scalar)
        if section.name == include.name:
            yield from self._given_to_parts(node)
        elif section.name == missions.name:
            yield from self._given_to_missions(node)
        elif section.name == args.name:
            yield from self._defaults(node)
        elif section.name == provides.name:
            for scalar in leaves(at(node, ("values",))):
                yield from self._reference(VALUE, scalar)

    def _reference(self, kind: str, scalar: ScalarNode) -> Iterator[Mention]:
        for scope in self.scopes:
            yield from self._mentions(scalar, 0, self.files.meanings(scope, kind, scalar.text))

    def _given_to_parts(self, node: TreeNode) -> Iterator[Mention]:
        for instance, entry in _entries(node):
            parts = [part for scope in self.scopes for part in self.files.parts(scope).get(instance, ())]
            for name, given in _entries(at(entry.value, ("with",))):
                for part in parts:
                    own = Symbol(part, args.name, name)
                    if own.name in self.files.visible(part, args.name):
                        yield from self._mentions(given.key, 0, frozenset({(NamePiece(0, len(name), own),)}))
                    for kind in kinds_of_argument(self.files, part, name):
                        for scalar in leaves(given.value):
                            yield from self._reference(kind, scalar)

    def _given_to_missions(self, node: TreeNode) -> Iterator[Mention]:
        there = [one for scope in self.scopes for one in self.files.missions(scope)]
        for mission, entry in _entries(node):
            for name, given in _entries(at(entry.value, ("with",))):
                for file in dict.fromkeys(file for one, file in there if one == mission):
                    declared = at(self.files.tree(file), ("inputs", name))
                    if declared is None:
                        continue
                    piece = NamePiece(0, len(name), Symbol(file, VARIABLE, name))
                    yield from self._mentions(given.key, 0, frozenset({(piece,)}))
                    if is_placed(declared):
                        for scalar in leaves(given.value):
                            yield from self._reference(PLACE, scalar)

    def _defaults(self, node: TreeNode) -> Iterator[Mention]:
        for name, entry in _entries(node):
            value = at(entry.value, ("default",)) or entry.value
            kinds = {kind for scope in self.scopes for kind in kinds_of_argument(self.files, scope, name)}
            for scalar in leaves(value) if not isinstance(value, MappingNode) else ():
                for kind in kinds:
                    yield from self._reference(kind, scalar)

    def _fills(self, node: TreeNode) -> Iterator[Mention]:
        for scalar in leaves(node):
            for start, name in filled_arguments(scalar.text):
                for scope in self.scopes:
                    if name in self.files.visible(scope, args.name):
                        piece = NamePiece(0, len(name), Symbol(scope, args.name, name))
                        yield from self._mentions(scalar, start, frozenset({(piece,)}))

    def _mentions(
        self, scalar: ScalarNode, start: int, meanings: Meanings, is_definition: bool = False
    ) -> Iterator[Mention]:
        yield from mentions(self.files, self.path, scalar, start, meanings, is_definition)


def mentions(
    files: ProjectFiles, path: Path, scalar: ScalarNode, start: int, meanings: Meanings, is_definition: bool = False
) -> Iterator[Mention]:
    """Yield the places of a word, which begins at `start` of a scalar, under each of its meanings."""
    for piece in {piece for one in meanings for piece in one}:
        place = files.places(path).of(scalar, start + piece.start, start + piece.end)
        is_own = is_definition and piece.start == 0 and all(len(one) == 1 for one in meanings)
        yield Mention(piece.symbol, path, *place, is_definition=is_own)


def references(
    files: ProjectFiles, scope: Path, section: Section[Any, Any], node: TreeNode
) -> list[tuple[str, ScalarNode]]:
    """Return the words of a section that name something, each with the kind of thing."""
    found: list[tuple[str, ScalarNode]] = []
    if section.name in (args.name, profiles.name):
        return found  # their values have the kinds of what they fill or change

    def record(kind: str, value: TreeNode) -> TreeNode:
        if kind not in _UNNAMED:
            found.extend((kind, scalar) for scalar in leaves(value))
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
                    entries = {**entry.value.entries, "type": Entry(word, word)}
                    changed[name] = Entry(entry.key, replace(entry.value, entries=entries))
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
                found |= {kind for kind, one in references(files, part, section, entry.value) if one.text == filler}
        for instance, entry in _entries(layer.get(include.name)):
            for inner, given in _entries(at(entry.value, ("with",))):
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
    word = at(declared, ("type",)) if isinstance(declared, MappingNode) else None
    return isinstance(word, ScalarNode) and word.text in PLACED


def leaves(node: TreeNode | None) -> Iterator[ScalarNode]:
    """Yield the words in a node, in lists and in the values of maps."""
    if isinstance(node, ScalarNode):
        yield node
    elif node is not None:
        for _, below in children(node):
            yield from leaves(below)


def _entries(node: TreeNode | None) -> list[tuple[str, Entry]]:
    return list(node.entries.items()) if isinstance(node, MappingNode) else []
