"""The composed robot as one manifest, with the origin of each value: its place, its layer, and how it was written."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rbxcompose.base.config import HIDDEN, Secret
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.base.printable import plain
from rbxcompose.base.units import Quantity
from rbxcompose.compiler.composition.dump import dump, dump_robot
from rbxcompose.compiler.composition.overlay import SET
from rbxcompose.compiler.composition.robot_manifest import ROBOT_LAYER, RobotManifest
from rbxcompose.manifest.arguments import show
from rbxcompose.manifest.shapes import exact
from rbxcompose.manifest.tree import (
    BROKEN,
    KeyPath,
    MappingNode,
    ScalarNode,
    SequenceNode,
    TreeNode,
    at,
    children,
    plain_value,
)

LONGEST = 60  # characters of a text shown beside a value
WIDEST = 60  # columns within which comments are aligned
_MARK = "\0"  # precedes a comment: no manifest contains it


@dataclass(frozen=True, slots=True)
class Origin:
    """`layer` is its name in findings ("the robot", "profile 'tired'"); `written` is empty if nothing was filled in."""

    span: Span
    layer: str
    written: str = ""

    @property
    def comment(self) -> str:
        """Return the origin in one line, without the column: "robots/one/robot.yaml:12, profile 'tired'"."""
        if self.span.file == SET:
            return self.layer.strip("'")
        layer = "overlay" if self.layer.startswith("overlay ") else self.layer
        shown = [self.span.place, *([layer] if layer not in ("", ROBOT_LAYER) else [])]
        return ", ".join(shown) + (f" = {plain(self.written, LONGEST)}" if self.written else "")


def origin_of(manifest: RobotManifest, path: KeyPath, node: TreeNode) -> Origin:
    """Return the origin of the value at `path`; `node` is the filled-in node there."""
    steps = manifest.history.of(path)
    source = steps[-1].node if steps else None
    is_filled = isinstance(source, ScalarNode) and "${" in source.text
    written = source.text if is_filled and isinstance(source, ScalarNode) else ""
    span = source.span if is_filled and source is not None else node.span
    return Origin(span, manifest.history.layer(path), written)


def is_leaf(node: TreeNode) -> bool:
    """Return whether a node has no children."""
    return not any(True for _ in children(node))


def indexed(root: TreeNode, path: Sequence[str | int]) -> KeyPath:
    """Return a path whose list indices, which count from 0, are numbers."""
    found: KeyPath = ()
    for key in path:
        is_item = isinstance(at(root, found), SequenceNode) and str(key).isdecimal()
        found = (*found, int(key) if is_item else key)
    return found


def shown(node: TreeNode) -> str:
    """Return a value in one line, for people; a secret is hidden."""
    match node:
        case ScalarNode() if node.filled in (None, BROKEN):
            return node.text
        case ScalarNode(filled=Secret()):
            return HIDDEN
        case ScalarNode():
            return show(node.filled)
        case SequenceNode(items=items):
            return f"[{', '.join(map(shown, items))}]"
        case MappingNode(entries=entries):
            return f"{{{', '.join(f'{name}: {shown(entry.value)}' for name, entry in entries.items())}}}"


def as_data(node: TreeNode) -> object:
    """Return a value as data for JSON: quantities as texts with their units, secrets hidden."""
    match node:
        case MappingNode(entries=entries):
            return {name: as_data(entry.value) for name, entry in entries.items()}
        case SequenceNode(items=items):
            return [as_data(item) for item in items]
        case ScalarNode(filled=Quantity(value=value, dimension=dimension)):
            return exact(value, dimension)
        case ScalarNode(filled=bool() | int() | float() | str()):
            return node.filled
        case ScalarNode(filled=None):
            return plain_value(node)
    return shown(node)


def expand(manifest: RobotManifest, *, has_origins: bool = True) -> str:
    """Return the robot with parts, profiles, overlays and values combined, as a manifest in block style.

    Its paths are relative to the folder of the robot's own file. Comments show the origin of each value. Secrets are
    shown by name.
    """
    if not has_origins:
        return dump_robot(manifest)
    return aligned(dump_robot(manifest, lambda path, node: _comment(manifest, path, node)))


def expand_below(manifest: RobotManifest, path: KeyPath, root: MappingNode, defaults: Mapping[str, str]) -> str:
    """Return everything below `path`, with origins, followed by the defaults of keys that are not written there.

    `root` is the map at `path`.
    """
    written = dump(root, lambda inner, node: _comment(manifest, (*path, *inner), node))
    return aligned(written + "".join(f"{key}: {value}  # {_MARK}by default\n" for key, value in defaults.items()))


def _comment(manifest: RobotManifest, path: KeyPath, node: TreeNode) -> str:
    return _MARK + origin_of(manifest, path, node).comment if is_leaf(node) else ""


def aligned(text: str) -> str:
    """Return lines with aligned comments; those of long lines follow directly."""
    lines = [line.partition(f"  # {_MARK}") for line in text.splitlines()]
    width = max((len(line) for line, mark, _ in lines if mark and len(line) <= WIDEST), default=0)
    return "".join(f"{line:<{width}}  # {comment}\n" if mark else f"{line}\n" for line, mark, comment in lines)


def expand_data(manifest: RobotManifest) -> dict[str, Any]:
    """Return the robot as data: its values as in a manifest, and the origin of each by its dotted path."""
    origins = {}
    for path, node in leaves(manifest.root):
        origin = origin_of(manifest, path, node)
        written = {"written": origin.written} if origin.written else {}
        origins[".".join(map(str, path))] = {**placed(origin.span), "layer": origin.layer, **written}
    return {"robot": as_data(manifest.root), "origins": origins}


def placed(span: Span) -> dict[str, Any]:
    """Return where a place begins, as data."""
    return {"file": span.file, "line": span.line, "column": span.column}


def leaves(node: TreeNode, path: KeyPath = ()) -> Iterator[tuple[KeyPath, TreeNode]]:
    """Yield every node without children, with its path."""
    if is_leaf(node):
        yield path, node
    for key, inner in children(node):
        yield from leaves(inner, (*path, key))
