"""The composed robot as one manifest, with the origin of each value after it."""

from collections.abc import Iterator, Mapping
from typing import Any

from rbxcompose.compiler.composition.dump import dump, dump_robot
from rbxcompose.compiler.composition.robot_manifest import RobotManifest
from rbxcompose.manifest.tree import KeyPath, MappingNode, TreeNode, children
from rbxcompose.tools.inspection.origin import as_data, is_leaf, origin_of

WIDEST = 60  # columns within which comments are aligned
_MARK = "\0"  # precedes a comment: no manifest contains it


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
    origins = {
        ".".join(map(str, path)): {
            "file": origin.span.file,
            "line": origin.span.line,
            "column": origin.span.column,
            "layer": origin.layer,
            **({"written": origin.written} if origin.written else {}),
        }
        for path, node in leaves(manifest.root)
        for origin in [origin_of(manifest, path, node)]
    }
    return {"robot": as_data(manifest.root), "origins": origins}


def leaves(node: TreeNode, path: KeyPath = ()) -> Iterator[tuple[KeyPath, TreeNode]]:
    """Yield every node without children, with its path."""
    if is_leaf(node):
        yield path, node
    for key, inner in children(node):
        yield from leaves(inner, (*path, key))
