"""Paths of a robot as people write them: `battery.runtime`, `missions.patrol.with.rounds`, `go_to.cmd_vel`."""

from rbxcompose.base.config import COMPONENT
from rbxcompose.base.findings import Finding, kind
from rbxcompose.base.printable import plain
from rbxcompose.compiler.composition.layers import in_section
from rbxcompose.compiler.composition.robot_manifest import RobotManifest
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.schema.guide import Guide
from rbxcompose.compiler.sections.composition import include
from rbxcompose.manifest.registry import naming, robot_keys
from rbxcompose.manifest.section import SetScope
from rbxcompose.manifest.tree import KeyPath, MappingNode, SequenceNode, TreeNode, at

NO_SUCH_PATH = kind("RBX9011")


def path_of(robot: Robot, text: str) -> KeyPath:
    """Return the path from the root that a text means; list items are counted from 0."""
    names: list[str | int] = list(text.strip().split("."))
    manifest = robot.manifest
    if names[0] not in robot_keys():
        names.insert(0, _section_of(manifest, str(names[0])))
    for index, name in enumerate(names):
        above = found_at(manifest, tuple(names[:index]))
        if isinstance(above, SequenceNode) and str(name).isdecimal():
            names[index] = int(name)
    return tuple(names)


def _section_of(manifest: RobotManifest, name: str) -> str:
    """Return the section that names something that runs; that of the components if no section does."""
    running = sorted(naming(COMPONENT), key=lambda one: one.scope is SetScope.BARE)
    return next(
        (declaration.name for declaration in running if name in declaration.names_in(manifest.root)), running[-1].name
    )


def short(path: KeyPath) -> str:
    """Return a path as people write it."""
    return ".".join(map(str, path[1:] if path[0] == "components" and len(path) > 1 else path))


def tree_of(manifest: RobotManifest, path: KeyPath) -> MappingNode:
    """Return the tree that a path belongs to: the section `include` is read before the rest, and kept beside it."""
    return manifest.include if path[:1] == (include.name,) else manifest.root


def found_at(manifest: RobotManifest, path: KeyPath) -> TreeNode | None:
    """Return the node at a path of the composed robot, or None."""
    return at(tree_of(manifest, path), path)


def no_such_path(robot: Robot, path: KeyPath, guide: Guide) -> Finding:
    """Return the finding for a path that does not exist, with the probable meaning of its first wrong name."""
    if path[0] == "profiles":
        return NO_SUCH_PATH.at(None, "profiles have no value of their own", help="'--profile NAME' applies one")
    length = next(n for n in range(1, len(path) + 1) if not is_known(robot.manifest, guide, path[:n]))
    above, name = path[: length - 1], str(path[length - 1])
    node = found_at(robot.manifest, above)
    valid = {*guide.keys(above), *(node.entries if isinstance(node, MappingNode) else ())}
    place = f"'{short(above)}'" if above else ""
    if above in ((), ("components",)):
        place = f"robot '{robot.manifest.name}'"
        valid |= {*robot.components, *(key for key in robot_keys() if key in robot.manifest.root)}
    elif len(above) == 2 and str(above[1]) in robot.components:
        valid |= {end.name for end in robot.components[str(above[1])].ends}
    if isinstance(node, SequenceNode):
        valid = {str(index) for index in range(len(node.items))}
    message = f"{place} has no '{plain(name, 60)}'"
    if above == ("components",) and (hint := in_section([str(key) for key in path[1:]], robot.manifest.root)):
        return NO_SUCH_PATH.at(None, message, help=hint)
    return NO_SUCH_PATH.misspelt(None, message, name, sorted(valid), "what it has")


def is_known(manifest: RobotManifest, guide: Guide, path: KeyPath) -> bool:
    """Return whether a path exists, or is a key that could be written there."""
    return found_at(manifest, path) is not None or str(path[-1]) in guide.keys(path[:-1])
