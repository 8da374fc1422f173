"""Where the boxes and lines of a picture go, from left to right: Graphviz decides.

It gets sizes, not texts, so that the same graph gives the same picture whatever fonts a machine has.
"""

import json
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import kind
from rbxcompose.commands.console import NotDoneError

MARGIN, GROUP_EDGE = 10.0, 26.0  # around the picture, and around a group's contents: room for its name [px]
_INCH = 72.0  # [px]
_GRAPH = {"rankdir": "LR", "nodesep": "0.2", "ranksep": "0.5"}
_NODE = {"fixedsize": "true", "label": ""}

NO_GRAPHVIZ = kind("RBX9013")

TOO_TANGLED = kind("RBX9014")
MOST_EFFORT = 25_000  # takes about a second

Edge = tuple[str, str]


@dataclass(frozen=True, slots=True)
class LayoutItem:
    """An item to be placed: its size [px], its group, if any, and whether its ends are round."""

    key: str
    width: float
    height: float
    group: str = ""
    is_round: bool = False


@dataclass(frozen=True, slots=True)
class Rect:
    """A rectangle by its upper left corner [px]."""

    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True, slots=True)
class Layout:
    """The positions of everything [px]; a path is the data of an SVG path, from the start of an edge to its end."""

    places: Mapping[str, Rect]
    paths: Mapping[Edge, str]
    groups: Mapping[str, Rect]
    width: float
    height: float


def graphviz() -> Any:
    """Return the module that runs Graphviz.

    Raises:
        NotDoneError: if it is not installed.
    """
    if find_spec("pygraphviz") is None:
        help_text = "install it with: pip install 'rbxcompose[graph]'"
        raise NotDoneError(NO_GRAPHVIZ.at(None, "a picture needs Graphviz, which is not installed", help=help_text))
    import pygraphviz

    return pygraphviz


def effort(items: int, edges: int) -> int:
    """Return about how hard a picture is to lay out: it grows with its size, and with the edges that no tree has."""
    return (items + edges) * max(1, edges - items)


def lay_out(items: Sequence[LayoutItem], edges: Sequence[Edge]) -> Layout:
    """Return a position for each item and a path for each edge; the same input gives the same picture.

    Raises:
        NotDoneError: if Graphviz is not installed.
    """
    graph = graphviz().AGraph(strict=False, directed=True, **_GRAPH)
    graph.node_attr.update(_NODE)
    graph.edge_attr.update(dir="none")
    for item in items:
        shape = "ellipse" if item.is_round else "box"
        graph.add_node(item.key, width=item.width / _INCH, height=item.height / _INCH, shape=shape)
    for group in dict.fromkeys(item.group for item in items if item.group):
        members = [item.key for item in items if item.group == group]
        graph.add_subgraph(members, name=f"cluster {group}", group=group, margin=GROUP_EDGE)
    for begin, end in edges:
        graph.add_edge(begin, end)
    return _read(json.loads(graph.draw(format="json0", prog="dot")), items)


def _read(drawn: dict[str, Any], items: Sequence[LayoutItem]) -> Layout:
    """Return the layout written by Graphviz, which counts y upwards."""
    _, _, width, height = _numbers(drawn["bb"])
    sizes = {item.key: item for item in items}
    places, groups, names = {}, {}, {}
    for entry in drawn.get("objects", ()):
        if "bb" in entry:
            left, bottom, right, top = _numbers(entry["bb"])
            groups[entry["group"]] = Rect(left + MARGIN, height - top + MARGIN, right - left, top - bottom)
        elif "pos" in entry:
            x, y = _numbers(entry["pos"])
            names[entry["_gvid"]] = item = sizes[entry["name"]]
            left, top = x - item.width / 2, height - y - item.height / 2
            places[item.key] = Rect(left + MARGIN, top + MARGIN, item.width, item.height)
    paths = {
        (names[edge["tail"]].key, names[edge["head"]].key): _path(edge["pos"], height)
        for edge in drawn.get("edges", ())
    }
    return Layout(places, paths, groups, width + 2 * MARGIN, height + 2 * MARGIN)


def _numbers(text: str) -> list[float]:
    return [float(number) for number in text.split(",")]


def _path(spline: str, height: float) -> str:
    """Return Graphviz's spline as the data of an SVG path: its start, then curves of three points each."""
    points = [_numbers(point) for point in spline.split()]
    first, *rest = [f"{x + MARGIN:.1f} {height - y + MARGIN:.1f}" for x, y in points]
    return f"M{first}C{' '.join(rest)}"
