"""Where a value of the composed robot comes from: its place, the layer that wrote it, and how it was written."""

from rbxcompose.base.config import HIDDEN, Secret
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.base.printable import plain
from rbxcompose.base.units import Quantity
from rbxcompose.compiler.composition.overlay import SET
from rbxcompose.compiler.composition.robot_manifest import ROBOT_LAYER, RobotManifest
from rbxcompose.manifest.arguments import show
from rbxcompose.manifest.shapes import exact
from rbxcompose.manifest.tree import BROKEN, KeyPath, MappingNode, ScalarNode, SequenceNode, TreeNode, plain_value

LONGEST = 60  # characters of a text shown beside a value


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
    match node:
        case MappingNode(entries=entries):
            return not entries
        case SequenceNode(items=items):
            return not items
    return True


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
