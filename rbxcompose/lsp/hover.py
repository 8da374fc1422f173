"""What is known about the text at a position, as Markdown."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.lsp.definition import word_at
from rbxcompose.lsp.document import Document, Spot
from rbxcompose.lsp.names import SKILL, below_profile
from rbxcompose.lsp.variables import fills, variables
from rbxcompose.manifest.tree import BROKEN, KeyPath, ScalarNode, at
from rbxcompose.model.robot import Robot
from rbxcompose.references import PLACE
from rbxcompose.units import Quantity, format_quantity


def describe(document: Document, line: int, column: int) -> str:
    """Return what is known about a position (from 0): its purpose, dimension, value and the origin of that."""
    spot = document.at(line, column)
    if spot is None or not spot.cursor.text:
        return ""
    return "\n\n".join(part for part in (_name(spot), _field(spot), _value(spot)) if part)


def _name(spot: Spot) -> str:
    """Return what the name at the position refers to."""
    word, cursor = word_at(spot), spot.cursor
    if word.startswith("${"):
        name = word.removeprefix("${").strip()
        return _told(f"${{{name}}}", fills(spot).get(name, ""))
    if word.startswith("$"):
        return _told(word, variables(spot).get(word.removeprefix("$").partition(".")[0], ""))
    if spot.document.is_mission:
        skill = _told(word, spot.known.of(SKILL).get(word, ""))
        return skill or ("" if cursor.is_key else _told(word, spot.known.of(PLACE).get(word, "")))
    if cursor.is_key:
        return ""
    kind = spot.guide.value(cursor.path).names
    return _told(word, spot.known.of(kind, cursor.path).get(word, "")) if kind else ""


def _told(name: str, about: str) -> str:
    return f"`{name}`: {about}" if about else ""


def _field(spot: Spot) -> str:
    """Return the purpose of the key, what it measures, and its default."""
    path = spot.cursor.place
    value = spot.guide.value(path)
    words = _type(spot) if spot.cursor.is_key else value.words.get(spot.cursor.text, "")
    dimension = f"Takes {value.dimension.phrase}." if value.dimension else ""
    default = "" if value.default is None else f"Default: `{value.default}`."
    return "\n\n".join(part for part in (words, spot.guide.describe(path), f"{dimension} {default}".strip()) if part)


def _type(spot: Spot) -> str:
    """Return what the type of the entry named at the position is."""
    place = (*spot.cursor.place, "type")
    word = at(spot.cursor.root, place)
    return spot.guide.value(place).words.get(word.text, "") if isinstance(word, ScalarNode) else ""


def _value(spot: Spot) -> str:
    """Return the value in the composed robot with its file, line and column, and the values it replaced."""
    robot = spot.known.robot
    if robot is None or spot.document.is_mission:
        return ""
    path = below_profile(spot.cursor.place)
    node = at(robot.manifest.root, path)
    if not isinstance(node, ScalarNode) or node.filled is BROKEN or not node.text:
        return ""
    filled = node.filled
    shown = format_quantity(filled.value, filled.dimension) if isinstance(filled, Quantity) else filled
    return f"`{node.text}`{'' if filled is None else f' = `{shown}`'} from {node.span}{''.join(_lost(robot, path))}"


def _lost(robot: Robot, path: KeyPath) -> Iterator[str]:
    """Yield the values that a later layer has replaced, latest first."""
    for step in reversed(robot.manifest.history.of(path)[:-1]):
        if isinstance(step.node, ScalarNode):
            yield f"; {step.layer} had `{step.node.text}` ({step.node.span})"
