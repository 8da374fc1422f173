"""Where the value of a manifest stands: the file, and the keys that lead to it there.

In a part, names are others than in the robot, and layers may each have written a piece of an entry.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rbxcompose.base.findings import Span
from rbxcompose.base.requests import Refused
from rbxcompose.compiler.composition.overlay import SET
from rbxcompose.compiler.composition.robot_manifest import RobotManifest
from rbxcompose.manifest.tree import KeyPath, MappingNode, ScalarNode, TreeNode, at
from rbxcompose.tools.mission_editor.yaml_places import Path as TextPath
from rbxcompose.tools.mission_editor.yaml_places import TextLines, placed
from rbxcompose.tools.robot_editor.map_patches import path_to

_BY_HAND = "change it there"
TextOf = Callable[[Path], str]


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
            raise Refused(f"'{path[-1]}' comes from the world '{world.text}', named at {world.span}: {_BY_HAND}")
        raise Refused(f"'{path[-1]}' stands in no file of the robot")
    pieces = {step.span: step for step in steps if step.node is not None}
    if len({span.file for span in pieces}) > 1:
        names = " and ".join(sorted({span.file for span in pieces}))
        raise Refused(f"'{path[-1]}' is written in several files: {names}: {_BY_HAND}")
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
            raise Refused(f"'{path[-1]}' is computed from '{node.text}' at {node.span}: {_BY_HAND}")
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
        raise Refused(f"it is written at {span}, which is no file of this robot: {_BY_HAND}")
    text = text_of(file)
    root, lines = placed(text), TextLines(text)
    form = "map" if isinstance(node, MappingNode) else "scalar" if isinstance(node, ScalarNode) else "list"
    found = None
    if root is not None and 0 < node.span.line <= len(lines.lines):
        start = lines.starts[node.span.line - 1] + node.span.column - 1
        found = path_to(root, start, form) or path_to(root, start, "scalar")  # the short form of a map
    if not found:
        raise Refused(f"it is written at {span} in a way that cannot be changed here: {_BY_HAND}")
    return file, found
