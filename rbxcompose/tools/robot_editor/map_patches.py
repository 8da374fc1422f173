"""Changes of entries in a YAML file as changes of its text: every byte that does not belong to the change stays.

A change that cannot be made without touching anything else is refused. `entry_at` and `value_at` return where an entry
or a value stands: in a part, names are others than in the robot, and layers may each have written a piece of an entry.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rbxcompose.base.findings import Span
from rbxcompose.base.requests import Refused
from rbxcompose.compiler.composition.overlay import SET
from rbxcompose.compiler.composition.robot_manifest import RobotManifest
from rbxcompose.manifest.tree import KeyPath, MappingNode, ScalarNode, TreeNode, at
from rbxcompose.manifest.yaml_nodes import compose
from rbxcompose.tools.mission_editor.yaml_places import (
    BLOCK_MARK,
    INDENT,
    SCALAR_MARK,
    PlacedNode,
    PlainTree,
    TextLines,
    YamlPatch,
    pair_in,
    placed,
    take_out,
    tree_at,
)
from rbxcompose.tools.mission_editor.yaml_places import Path as TextPath

_BY_HAND, _THERE = "change it in the file", "change it there"
TextOf = Callable[[Path], str]


class MapPatch(YamlPatch):
    """Makes one change of the entries of a text; each method raises `Refused` if that is impossible."""

    BY_HAND = _BY_HAND

    def __init__(self, text: str) -> None:
        root = placed(text)
        if root is None or compose(text, "")[1] is not None or root.form != "map":
            raise Refused(f"the file cannot be read: {_BY_HAND} first")
        super().__init__(TextLines(text), root)
        self.text = text

    def set(self, path: TextPath, values: dict[str, str]) -> None:
        """Give values, as YAML of one line, to keys of the map at `path`; those that it lacks are added."""
        node = self.map_at(path)
        added: list[str] = []
        for key, written in values.items():
            old, plain = node.get(key), _plain(written)
            if old is None:
                added.append(f"{key}: {written}")
                tree_at(self.tree, path)[1].append([("scalar", key, SCALAR_MARK), plain])
                continue
            self.require_own(old, key)
            if (old.form != "scalar" and not old.is_flow) or "\n" in self.text[old.start : old.end]:
                raise Refused(f"'{key}' is written in several lines: {_BY_HAND}")
            gap = " " if old.start == old.end and self.text[old.start - 1 : old.start] == ":" else ""
            self.replace(old.start, old.end, f"{gap}{written}")
            pair_in(tree_at(self.tree, path), key)[1] = plain
        if added:
            self.append(node, added)

    def add(self, path: TextPath, key: str, value: str) -> None:
        """Add an entry at the end of the map at `path`; the maps that lead there are made if they are not."""
        known = path
        while known and ((node := self.root.at(known)) is None or _is_nothing(node)):
            known = known[:-1]
        node = self.map_at(known)
        missing = path[len(known) :]
        if not missing:
            if node.get(key) is not None:
                raise Refused(f"there is '{key}' already")
            self.append(node, [f"{key}: {value}"])
            tree_at(self.tree, path)[1].append([("scalar", key, SCALAR_MARK), _plain(value)])
            return
        tree: PlainTree = [[("scalar", key, SCALAR_MARK), _plain(value)]]
        for name in reversed(missing[1:]):
            tree = [[("scalar", str(name), SCALAR_MARK), ["map", tree, BLOCK_MARK]]]
        inner = [*(f"{' ' * INDENT * depth}{name}:" for depth, name in enumerate(missing[1:], 1))]
        inner.append(f"{' ' * INDENT * len(missing)}{key}: {value}")
        top, above = str(missing[0]), tree_at(self.tree, known)
        if (old := node.get(top)) is not None:  # a key without a value
            if node.is_flow or not self.lines.begins(node.pairs[0][0].start):
                raise Refused(f"'{top}' is written within a line: {_BY_HAND}")
            word = next(word for word, value in node.pairs if value is old)
            column = self.lines.column(word.start)
            self.paste(self.lines.of(word.end) + 1, "\n".join(f"{' ' * column}{line}" for line in inner))
            pair_in(above, top)[1] = ["map", tree, BLOCK_MARK]
            return
        if node.is_flow:
            raise Refused(f"there is no '{top}', and what is around it is written within a line: {_BY_HAND}")
        apart = [""] if not known and "\n\n" in self.text else []  # as the other sections are
        self.append(node, [*apart, f"{top}:", *inner])
        above[1].append([("scalar", top, SCALAR_MARK), ["map", tree, BLOCK_MARK]])

    def rename(self, path: TextPath, name: str) -> None:
        """Give the entry at `path` another name."""
        above = self.map_at(path[:-1])
        if above.get(name) is not None:
            raise Refused(f"there is '{name}' already")
        key = next((key for key, _ in above.pairs if key.text == path[-1]), None)
        if key is None or key.form != "scalar":
            raise Refused("the file has changed: load it again")
        self.replace(key.start, key.end, name)
        pair_in(tree_at(self.tree, path[:-1]), path[-1])[0] = ("scalar", name, SCALAR_MARK)

    def remove(self, path: TextPath) -> None:
        """Take the entry at `path` out, with the map around it if that would be empty."""
        if self.root.at(path) is None:
            raise Refused("the file has changed: load it again")
        while len(path) > 1 and len(self.map_at(path[:-1]).pairs) == 1:
            path = path[:-1]  # an empty section is no section
        above = self.map_at(path[:-1])
        at = next((at for at, (key, _) in enumerate(above.pairs) if key.text == path[-1]), None)
        if at is None:
            raise Refused("the file has changed: load it again")
        key, value = above.pairs[at]
        for node in value.all():
            if node.mark and node.mark[0] is not None:
                raise Refused(f"'{path[-1]}' has the anchor '&{node.mark[0]}', which others use: {_BY_HAND}")
        if above.is_flow:
            self.remove_within_line(above, at)
        else:
            if not self.lines.begins(key.start):
                raise Refused(f"'{path[-1]}' is written within a line: {_BY_HAND}")
            first, last = self.lines.region(key.start, max(value.end, key.end + 1), self.lines.column(key.start))
            self.cut(first, last)
        take_out(tree_at(self.tree, path[:-1]), path[-1])

    def remove_within_line(self, above: PlacedNode, at: int) -> None:
        """Take an entry in brackets out, with the comma before or behind it."""
        (key, value), is_last = above.pairs[at], at == len(above.pairs) - 1
        end_of = max(value.end, key.end)
        if at > 0:
            before = above.pairs[at - 1]
            start, end = max(before[1].end, before[0].end + 1), end_of
        else:
            start, end = key.start, end_of if is_last else above.pairs[1][0].start
        if "#" in self.text[start : key.start] or "#" in self.text[end_of:end]:
            raise Refused(f"there is a comment between its neighbours: {_BY_HAND}")
        self.replace(start, end, "")

    # What they are made of

    def map_at(self, path: TextPath) -> PlacedNode:
        """Return the map at a path that nothing else has a part in."""
        node: PlacedNode | None = self.root
        if not all(isinstance(key, str) for key in path):
            raise Refused(f"'{path[-1]}' is part of a list: {_BY_HAND}")
        for length in range(len(path) + 1):
            node = self.root.at(path[:length])
            if node is None:
                raise Refused(f"there is no '{'.'.join(map(str, path[:length]))}' in the file: load it again")
            self.require_own(node, str(path[length - 1]) if length else "the file")
        if node is None or node.form != "map":
            raise Refused(f"'{'.'.join(map(str, path))}' is no map in the file: {_BY_HAND}")
        return node

    def require_own(self, node: PlacedNode, what: str) -> None:
        """Refuse what is written once and used twice.

        Raises:
            Refused: with the anchor.
        """
        line = self.lines.of(node.start) + 1
        if node.form == "alias":
            raise Refused(f"'{what}' is '*{node.text}' in line {line}, which is written elsewhere: {_BY_HAND}")
        if node.mark and node.mark[0] is not None:
            raise Refused(f"'{what}' has the anchor '&{node.mark[0]}' in line {line}, which others use: {_BY_HAND}")

    def append(self, node: PlacedNode, lines: list[str]) -> None:
        """Write entries behind the last one of a map."""
        if node.is_flow:
            if len(node.pairs) == 0:
                self.replace(node.start + 1, node.start + 1, ", ".join(lines))
                return
            key, value = node.pairs[-1]
            end = max(value.end, key.end + 1) if value.start != value.end else key.end + 1
            self.replace(end, end, "".join(f", {line}" for line in lines))
            return
        key, value = node.pairs[-1]
        if not self.lines.begins(key.start):
            raise Refused(f"'{key.text}' is written within a line: {_BY_HAND}")
        column = self.lines.column(key.start)
        _, last = self.lines.region(key.start, max(value.end, key.end + 1), column)
        self.paste(last, "\n".join(f"{' ' * column}{line}" for line in lines))


def _is_nothing(node: PlacedNode) -> bool:
    return node.form == "scalar" and not node.text and node.start == node.end


def _plain(written: str) -> PlainTree:
    """Return the tree of a value.

    Raises:
        Refused: if it is none that fits into a line.
    """
    root = placed(f"a: {written}\n") if "\n" not in written else None
    value = root.get("a") if root is not None and root.form == "map" and len(root.pairs) == 1 else None
    if value is None or value.form == "alias" or value.end != len(written) + 3:
        raise Refused(f"'{written[:60]}' is no value")
    return value.plain()


def file_of(manifest: RobotManifest, path: KeyPath) -> Path | None:
    """Return the file that has the last word about an entry; None if no file has."""
    steps = manifest.history.of(path)
    return manifest.files.get(steps[-1].span.file) if steps else None


def entry_at(manifest: RobotManifest, path: KeyPath, text_of: TextOf) -> tuple[Path, TextPath]:
    """Return the file that says an entry, and the path to it there.

    Raises:
        Refused: if it is not written in one place, of a file.
    """
    steps = manifest.history.of(path)
    if not steps or steps[-1].node is None:
        world = at(manifest.root, ("world",))
        if path[0] == "places" and isinstance(world, ScalarNode):
            raise Refused(f"'{path[-1]}' comes from the world '{world.text}', named at {world.span}: {_THERE}")
        raise Refused(f"'{path[-1]}' stands in no file of the robot")
    pieces = {step.span: step for step in steps if step.node is not None}
    if len({span.file for span in pieces}) > 1:
        names = " and ".join(sorted({span.file for span in pieces}))
        raise Refused(f"'{path[-1]}' is written in several files: {names}: {_THERE}")
    return _located(manifest, steps[-1].node, steps[-1].span, text_of)


def value_at(manifest: RobotManifest, path: KeyPath, text_of: TextOf) -> tuple[Path, TextPath, str]:
    """Return the file that says a value, the path to the map that has it there, and its key.

    Of a value that nobody has written, that is where the map around it is.

    Raises:
        Refused: if no file says it, or it is computed.
    """
    steps = manifest.history.of(path)
    node = steps[-1].node if steps else None
    if node is not None:
        if isinstance(node, ScalarNode) and "${" in node.text:
            raise Refused(f"'{path[-1]}' is computed from '{node.text}' at {node.span}: {_THERE}")
        file, place = _located(manifest, node, steps[-1].span, text_of)
        return file, place[:-1], str(place[-1])
    above = manifest.history.of(path[:-1])
    if not above or not isinstance(above[-1].node, MappingNode):
        entry_at(manifest, path[:2], text_of)  # it may know why
        raise Refused(f"'{path[-2]}' is no map in a file of the robot")
    file, place = _located(manifest, above[-1].node, above[-1].span, text_of)
    return file, place, str(path[-1])


def _located(manifest: RobotManifest, node: TreeNode, span: Span, text_of: TextOf) -> tuple[Path, TextPath]:
    if span.file == SET:
        raise Refused("it was given by '--set', which is in no file: start the robot without it")
    file = manifest.files.get(span.file)
    if file is None:
        raise Refused(f"it is written at {span}, which is no file of this robot: {_THERE}")
    text = text_of(file)
    root, lines = placed(text), TextLines(text)
    form = "map" if isinstance(node, MappingNode) else "scalar" if isinstance(node, ScalarNode) else "list"
    found = None
    if root is not None and 0 < node.span.line <= len(lines.lines):
        start = lines.starts[node.span.line - 1] + node.span.column - 1
        found = _path_to(root, start, form) or _path_to(root, start, "scalar")  # the short form of a map
    if not found:
        raise Refused(f"it is written at {span} in a way that cannot be changed here: {_THERE}")
    return file, found


def _path_to(root: PlacedNode, start: int, form: str) -> TextPath | None:
    """Return the path of the value with this form that begins at an offset of the text; None if there is none."""
    waiting: list[tuple[TextPath, PlacedNode]] = [((), root)]
    while waiting:
        path, node = waiting.pop()
        if path and node.start == start and node.form == form:
            return path
        waiting += [((*path, key.text), value) for key, value in node.pairs]
        waiting += [((*path, index), item) for index, item in enumerate(node.items)]
    return None
