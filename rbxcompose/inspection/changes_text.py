"""What another manifest would change in a running robot, with the places that say so, as text or as data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rbxcompose.composition.overlay import SET
from rbxcompose.findings import Span
from rbxcompose.manifest.tree import KeyPath, SequenceNode, TreeNode, at, key_span, value_span
from rbxcompose.model.robot import Robot
from rbxcompose.plan.diff import Change
from rbxcompose.printable import plain

LONGEST = 6  # reasons shown for one component
_TOPIC = "topic of "  # prefix of the key of a wire
_TEXT = 200  # characters of a reason


def with_places(found: Mapping[str, Any], robot: Robot) -> dict[str, Any]:
    """Return the difference, with the place of each new value that is written in the robot's files."""
    components = [
        {**one, "reasons": [{**each, "place": _place(robot, one["name"], each)} for each in one["reasons"]]}
        for one in found["components"]
    ]
    return {**found, "components": components}


def changes_text(found: Mapping[str, Any]) -> str:
    """Return the result of `with_places` for people: component by component, with the reasons."""
    return "\n".join(_lines(found))


def _lines(found: Mapping[str, Any]) -> Iterator[str]:
    components = found["components"]
    fates = dict.fromkeys(one["fate"] for one in components)
    counts = (f"{sum(one['fate'] == fate for one in components)} {fate}" for fate in fates)
    yield f"{found['robot']}: {', '.join(counts)}"
    widths = [max(len(one[column]) for one in components) for column in ("fate", "name")]
    for one in components:
        yield f"  {one['fate']:<{widths[0]}}  {one['name']:<{widths[1]}}  process {one['process']}"
        shown = one["reasons"][:LONGEST]
        yield from (f"      {_reason(each)}" for each in shown)
        if len(shown) < len(one["reasons"]):
            yield f"      and {len(one['reasons']) - len(shown)} more"


def _reason(each: Mapping[str, str]) -> str:
    text = plain(str(Change(each["key"], each["before"], each["after"])), _TEXT)
    place = each["place"]
    return f"{text} {'by' if place == SET else 'at'} {place}" if place else text


def _place(robot: Robot, component: str, reason: Mapping[str, str | None]) -> str:
    """Return the place of the new value, empty if it is not written."""
    key = str(reason["key"])
    if component not in robot.components or reason["after"] is None:
        return ""
    root, path, least = _source(robot, component, key)
    path = _indexed(root, path)
    if at(root, path[:least]) is None:
        return ""
    span: Span = value_span(root, path) if at(root, path) is not None else key_span(root, path)
    return SET if span.file == SET else str(span)


def _source(robot: Robot, component: str, key: str) -> tuple[TreeNode, KeyPath, int]:
    """Return the tree that contains a key of a component, its path there, and how much of that path must exist."""
    root, own = robot.manifest.root, robot.components[component].path
    if key.startswith(_TOPIC):
        return root, (*own, "connect", key.removeprefix(_TOPIC)), len(own) + 2
    keys = tuple(key.split("."))
    match keys:
        case _ if at(root, own) is not None:
            return root, (*own, *keys), len(own) + 1
        case ("programs", name, *rest) if name in robot.missions:
            return robot.missions[name].program.root, tuple(rest), 0
        case ("inputs", name, *rest):
            return root, ("missions", name, "with", *rest), 3
    return root, keys, 1


def _indexed(root: TreeNode, path: KeyPath) -> KeyPath:
    """Return a path whose list indices are numbers."""
    found: KeyPath = ()
    for key in path:
        is_item = isinstance(at(root, found), SequenceNode) and str(key).isdigit()
        found = (*found, int(key) if is_item else key)
    return found
