"""The composed robot as one manifest, with the origin of each value after it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rbxcompose.composition.dump import dump, dump_robot
from rbxcompose.composition.robot_manifest import RobotManifest
from rbxcompose.inspection.origin import as_data, is_leaf, origin_of
from rbxcompose.manifest.tree import KeyPath, MappingNode, TreeNode, children

WIDEST = 60  # columns up to which comments stand below each other
_MARK = "\0"  # before a comment: no manifest holds it


def expand(manifest: RobotManifest, *, has_origins: bool = True) -> str:
    """Return the robot with parts, profiles, overlays and values put together, as a manifest in block style.

    It stands for the folder of the robot's own file. Comments tell where each value is from. Secrets keep their names.
    """
    if not has_origins:
        return dump_robot(manifest)
    return aligned(dump_robot(manifest, lambda path, node: _comment(manifest, path, node)))


def expand_below(manifest: RobotManifest, path: KeyPath, root: MappingNode, defaults: Mapping[str, str]) -> str:
    """Return what stands below `path`, with origins, and then the defaults of what is not written there.

    `root` is the map at `path`.
    """
    written = dump(root, lambda inner, node: _comment(manifest, (*path, *inner), node))
    return aligned(written + "".join(f"{key}: {value}  # {_MARK}by default\n" for key, value in defaults.items()))


def _comment(manifest: RobotManifest, path: KeyPath, node: TreeNode) -> str:
    return _MARK + origin_of(manifest, path, node).comment if is_leaf(node) else ""


def aligned(text: str) -> str:
    """Return lines with their comments below each other; those of long lines follow them directly."""
    lines = [line.partition(f"  # {_MARK}") for line in text.splitlines()]
    width = max((len(line) for line, mark, _ in lines if mark and len(line) <= WIDEST), default=0)
    return "".join(f"{line:<{width}}  # {comment}\n" if mark else f"{line}\n" for line, mark, comment in lines)


def expand_data(manifest: RobotManifest) -> dict[str, Any]:
    """Return the robot as data: its values as a manifest has them, and the origin of each by its path with dots."""
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
    """Yield everything below which nothing stands, with its path."""
    if is_leaf(node):
        yield path, node
    for key, inner in children(node):
        yield from leaves(inner, (*path, key))
