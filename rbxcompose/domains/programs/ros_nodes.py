"""From what a node of ROS 2 has on its bus to what its component declares: pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Edit, Span
from rbxcompose.domains.programs.watch import OWN
from rbxcompose.manifest.tree import MappingNode, SequenceNode, TreeNode

_SEND_GOAL = "/_action/send_goal"
KINDS = ("publishes", "subscribes", "serves", "calls", "serves_actions", "calls_actions")
"""The keys of a component, in the order in which they are written."""


@dataclass(frozen=True, slots=True)
class RosNode:
    """A node of ROS 2: types by name for each of `KINDS`, without what every node has; and which topics are latched."""

    name: str
    ends: Mapping[str, Mapping[str, str]]
    latched: frozenset[str] = field(default_factory=frozenset)

    @classmethod
    def of(cls, name: str, found: Mapping[str, Any]) -> RosNode:
        """Read what ROS's side says of it; a topic with several types counts with the first."""
        ends: dict[str, dict[str, str]] = {kind: {} for kind in KINDS}
        for kind in ("publishes", "subscribes", "serves", "calls"):
            for topic, types in found.get(kind, {}).items():
                if topic.endswith(_SEND_GOAL):
                    action = types[0].replace("/action/", "/").removesuffix("_SendGoal")
                    ends[f"{kind}_actions"][topic.removesuffix(_SEND_GOAL)] = action
                elif "/_action/" not in topic and not OWN.search(topic):
                    ends[kind][topic] = _short(types[0])
        return cls(name, ends, frozenset(found.get("latched", ())) & ends["publishes"].keys())

    def value(self, kind: str, topic: str) -> str:
        """Return what the manifest says of a topic, a service or an action."""
        type_ = self.ends[kind][topic]
        return f"{{type: {type_}, qos: latched}}" if kind == "publishes" and topic in self.latched else type_


def _short(name: str) -> str:
    package, _, bare = name.split("/")
    return f"{package}/{bare}"


def edits_of(node: RosNode, component: MappingNode, text: str) -> Iterator[Edit]:
    """Yield the edits that declare what a node has and its component does not; `text` is that of the file."""
    new: dict[str, dict[str, str]] = {}
    for kind in KINDS:
        entry = component.entries.get(kind)
        known = entry.value.entries if entry is not None and isinstance(entry.value, MappingNode) else {}
        there = {topic.strip("/") for topic in known}
        added = {
            _written(topic): node.value(kind, topic)
            for topic in sorted(node.ends[kind])
            if topic.strip("/") not in there
        }
        if not added:
            continue
        if entry is not None and isinstance(entry.value, MappingNode) and known:
            yield _addition(entry.value, text, [f"{topic}: {value}" for topic, value in added.items()])
        else:
            new[kind] = added
    if not new:
        return
    if _is_flow(component, text):
        inner = {kind: ", ".join(f"{topic}: {value}" for topic, value in added.items()) for kind, added in new.items()}
        yield _addition(component, text, [f"{kind}: {{{words}}}" for kind, words in inner.items()])
    else:
        lines = [
            line
            for kind, added in new.items()
            for line in (f"{kind}:", *(f"  {topic}: {value}" for topic, value in added.items()))
        ]
        yield _addition(component, text, lines)


def _written(topic: str) -> str:
    """Return a topic as a manifest writes it: `scan` for `/scan`, but `/tf` as it is."""
    return topic if topic in ("/tf", "/tf_static") else topic.removeprefix("/")


def _is_flow(node: MappingNode, text: str) -> bool:
    line = text.split("\n")[node.span.line - 1]
    return line[node.span.column - 1 : node.span.column] == "{"


def _addition(above: MappingNode, text: str, lines: list[str]) -> Edit:
    """Return the edit that adds entries behind the last one of a map, in its style."""
    end = _end(above)
    if _is_flow(above, text):
        at = Span(end.file, end.end_line, end.end_column, end.end_line, end.end_column)
        return Edit(at, "", "".join(f", {line}" for line in lines))
    indent = " " * (next(iter(above.entries.values())).key.span.column - 1)
    column = len(text.split("\n")[end.end_line - 1]) + 1  # behind a comment
    at = Span(end.file, end.end_line, column, end.end_line, column)
    return Edit(at, "", "".join(f"\n{indent}{line}" for line in lines))


def _end(node: TreeNode) -> Span:
    """Return the place of the last thing that is written in a value: that of a block ends where the next one begins."""
    match node:
        case MappingNode() if node.entries:
            return max((_end(entry.value) for entry in node.entries.values()), key=_order)
        case SequenceNode() if node.items:
            return max(map(_end, node.items), key=_order)
    return node.span


def _order(span: Span) -> tuple[int, int]:
    return span.end_line, span.end_column
