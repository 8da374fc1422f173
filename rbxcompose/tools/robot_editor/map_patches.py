"""Changes of entries in a YAML file as changes of its text: every byte that does not belong to the change stays.

As with missions, what comes of a change is parsed again, and refused if it is not exactly the tree that was meant.
"""

from __future__ import annotations

from itertools import pairwise

from rbxcompose.base.requests import Refused
from rbxcompose.manifest.yaml_nodes import compose
from rbxcompose.tools.mission_editor.patch import TextEdit, TextPatch
from rbxcompose.tools.mission_editor.yaml_places import Path, PlacedNode, PlainTree, TextLines, placed

INDENT = 2
_BY_HAND = "change it in the file"
_SCALAR = (None, None, "")  # the mark of a scalar without quotes
_BLOCK = (None, None)  # of a map


def with_values(text: str, path: Path, values: dict[str, str]) -> TextPatch:
    """Return how keys of the map at `path` get values, given as YAML of one line; those that it lacks are added.

    Raises:
        Refused: as all of these do, if that cannot be done without touching anything else.
    """
    patch = _MapPatch(text)
    patch.set(path, values)
    return patch.done()


def with_entry(text: str, path: Path, key: str, value: str) -> TextPatch:
    """Return how the map at `path` gets a new entry at its end; the maps that lead there are made if they are not."""
    patch = _MapPatch(text)
    patch.add(path, key, value)
    return patch.done()


def with_name(text: str, path: Path, name: str) -> TextPatch:
    """Return how the entry at `path` gets another name."""
    patch = _MapPatch(text)
    patch.rename(path, name)
    return patch.done()


def without_entry(text: str, path: Path) -> TextPatch:
    """Return how the entry at `path` is taken out, with the map around it if that would be empty."""
    patch = _MapPatch(text)
    patch.remove(path)
    return patch.done()


class _MapPatch:
    """Collects the edits of one change, and what the tree is to be afterwards."""

    def __init__(self, text: str) -> None:
        root = placed(text)
        if root is None or compose(text, "")[1] is not None or root.form != "map":
            raise Refused(f"the file cannot be read: {_BY_HAND} first")
        self.text, self.lines, self.root = text, TextLines(text), root
        self.tree: PlainTree = root.plain()
        self.edits: list[TextEdit] = []

    def set(self, path: Path, values: dict[str, str]) -> None:
        node = self.map_at(path)
        added: list[str] = []
        for key, written in values.items():
            old, plain = node.get(key), _plain(written)
            if old is None:
                added.append(f"{key}: {written}")
                _at(self.tree, path)[1].append([("scalar", key, _SCALAR), plain])
                continue
            self.require_own(old, key)
            if old.form not in ("scalar", "list", "map") or (old.form != "scalar" and not old.is_flow):
                raise Refused(f"'{key}' is written in several lines: {_BY_HAND}")
            if "\n" in self.text[old.start : old.end]:
                raise Refused(f"'{key}' is written in several lines: {_BY_HAND}")
            gap = " " if old.start == old.end and self.text[old.start - 1 : old.start] == ":" else ""
            self.edits.append(TextEdit(old.start, old.end, f"{gap}{written}"))
            _pair(_at(self.tree, path), key)[1] = plain
        if added:
            self.append(node, added)

    def add(self, path: Path, key: str, value: str) -> None:
        known = path
        while known and ((node := self.root.at(known)) is None or _is_nothing(node)):
            known = known[:-1]
        node = self.map_at(known)
        missing = path[len(known) :]
        if not missing:
            if node.get(key) is not None:
                raise Refused(f"there is '{key}' already")
            self.append(node, [f"{key}: {value}"])
            _at(self.tree, path)[1].append([("scalar", key, _SCALAR), _plain(value)])
            return
        tree: PlainTree = [[("scalar", key, _SCALAR), _plain(value)]]
        for name in reversed(missing[1:]):
            tree = [[("scalar", str(name), _SCALAR), ["map", tree, _BLOCK]]]
        inner = [*(f"{' ' * INDENT * depth}{name}:" for depth, name in enumerate(missing[1:], 1))]
        inner.append(f"{' ' * INDENT * len(missing)}{key}: {value}")
        top, above = str(missing[0]), _at(self.tree, known)
        if (old := node.get(top)) is not None:  # a key without a value
            if node.is_flow or not self.lines.begins(node.pairs[0][0].start):
                raise Refused(f"'{top}' is written within a line: {_BY_HAND}")
            word = next(word for word, value in node.pairs if value is old)
            column = self.lines.column(word.start)
            self.insert_below(self.lines.of(word.end), [f"{' ' * column}{line}" for line in inner])
            _pair(above, top)[1] = ["map", tree, _BLOCK]
            return
        if node.is_flow:
            raise Refused(f"there is no '{top}', and what is around it is written within a line: {_BY_HAND}")
        apart = [""] if not known and "\n\n" in self.text else []  # as the other sections are
        self.append(node, [*apart, f"{top}:", *inner])
        above[1].append([("scalar", top, _SCALAR), ["map", tree, _BLOCK]])

    def rename(self, path: Path, name: str) -> None:
        above = self.map_at(path[:-1])
        if above.get(name) is not None:
            raise Refused(f"there is '{name}' already")
        key = next((key for key, _ in above.pairs if key.text == path[-1]), None)
        if key is None or key.form != "scalar":
            raise Refused("the file has changed: load it again")
        self.edits.append(TextEdit(key.start, key.end, name))
        _pair(_at(self.tree, path[:-1]), path[-1])[0] = ("scalar", name, _SCALAR)

    def remove(self, path: Path) -> None:
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
            start, end = self.lines.starts[first], self.lines.place(last)
            if last >= self.lines.count and self.lines.is_open and start > 0:
                start -= 1  # with the end of the line before
            self.edits.append(TextEdit(start, end, ""))
        tree = _at(self.tree, path[:-1])
        tree[1].remove(_pair(tree, path[-1]))

    def remove_within_line(self, above: PlacedNode, at: int) -> None:
        (key, value), is_last = above.pairs[at], at == len(above.pairs) - 1
        end_of = max(value.end, key.end)
        if at > 0:
            before = above.pairs[at - 1]
            start, end = max(before[1].end, before[0].end + 1), end_of
        else:
            start, end = key.start, end_of if is_last else above.pairs[1][0].start
        if "#" in self.text[start : key.start] or "#" in self.text[end_of:end]:
            raise Refused(f"there is a comment between its neighbours: {_BY_HAND}")
        self.edits.append(TextEdit(start, end, ""))

    # What they are made of

    def map_at(self, path: Path) -> PlacedNode:
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
                self.edits.append(TextEdit(node.start + 1, node.start + 1, ", ".join(lines)))
                return
            key, value = node.pairs[-1]
            end = max(value.end, key.end + 1) if value.start != value.end else key.end + 1
            self.edits.append(TextEdit(end, end, "".join(f", {line}" for line in lines)))
            return
        key, value = node.pairs[-1]
        if not self.lines.begins(key.start):
            raise Refused(f"'{key.text}' is written within a line: {_BY_HAND}")
        column = self.lines.column(key.start)
        _, last = self.lines.region(key.start, max(value.end, key.end + 1), column)
        self.insert_below(last - 1, [f"{' ' * column}{line}" for line in lines])

    def insert_below(self, line: int, lines: list[str]) -> None:
        at, block = self.lines.place(line + 1), "\n".join(lines)
        is_behind = line + 1 >= self.lines.count and self.lines.is_open
        self.edits.append(TextEdit(at, at, f"\n{block}" if is_behind else f"{block}\n"))

    def done(self) -> TextPatch:
        """Return the change, if it does what was meant and nothing else."""
        edits = sorted(self.edits, key=lambda edit: (edit.start, edit.end))
        made = TextPatch(tuple(edits), ())
        is_apart = all(one.end <= other.start for one, other in pairwise(edits))
        root = placed(made.applied(self.text)) if is_apart else None
        if root is None or root.plain() != self.tree:
            raise Refused(f"this cannot be done without changing something else: {_BY_HAND}")
        return made


def path_to(root: PlacedNode, start: int, form: str) -> Path | None:
    """Return the path of the value with this form that begins at an offset of the text; None if there is none."""
    waiting: list[tuple[Path, PlacedNode]] = [((), root)]
    while waiting:
        path, node = waiting.pop()
        if path and node.start == start and node.form == form:
            return path
        waiting += [((*path, key.text), value) for key, value in node.pairs]
        waiting += [((*path, index), item) for index, item in enumerate(node.items)]
    return None


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


def _at(tree: PlainTree, path: Path) -> PlainTree:
    for key in path:
        tree = _pair(tree, key)[1]
    return tree


def _pair(tree: PlainTree, key: str | int) -> PlainTree:
    return next(pair for pair in tree[1] if pair[0][1] == key)
