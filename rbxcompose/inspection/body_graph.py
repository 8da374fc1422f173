"""A body as a graph: its links, and the joints between them. Graphviz draws it."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.body.model import FLOATING, Body, BodyJoint
from rbxcompose.geometry import Vector3
from rbxcompose.inspection.layout import graphviz
from rbxcompose.printable import plain

FORMATS = ("svg", "pdf")
_MOVES = 'color="#1f6feb" fontcolor="#1f6feb" penwidth=2.2'
_FIXED = 'color="#6e7781" fontcolor="#6e7781"'
_FLOATS = f"{_FIXED} style=dashed"
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def draw_graph(body: Body, form: str) -> bytes:
    """Return the graph of a body in one of `FORMATS`.

    Raises:
        NotDrawnError: if Graphviz is not installed.
    """
    drawn: bytes = graphviz().AGraph(string=body_dot(body)).draw(format=form, prog="dot")
    return drawn


def body_dot(body: Body) -> str:
    """Return the graph in DOT: links as boxes, joints as arrows; those that move are blue and thick."""
    return "".join(f"{line}\n" for line in _lines(body))


def _lines(body: Body) -> Iterator[str]:
    numbers = {name: f"n{number}" for number, (name, _) in enumerate(body.walk())}
    yield f"digraph {_label(body.name)} {{"
    yield '  graph [rankdir=TB fontname="sans-serif" nodesep=0.3 ranksep=0.6]'
    yield '  node [fontname="sans-serif" fontsize=11 shape=box style=rounded]'
    yield '  edge [fontname="sans-serif" fontsize=9]'
    for name, key in numbers.items():
        yield f"  {key} [label={_label(name)}]"
        for joint in body.joints_below[name]:
            yield f"  {key} -> {numbers[joint.child]} [label={_label(joint.name, *_words(joint))} {_style(joint)}]"
    yield "}"


def _words(joint: BodyJoint) -> list[str]:
    """Return the type of a joint, with its axis if it has one, and which joint it follows."""
    if not joint.moves:
        return [joint.kind]
    words = [f"{joint.kind}, {axis_words(joint.axis)}"]
    return [*words, f"mimics {joint.mimic.joint}"] if joint.mimic else words


def axis_words(axis: Vector3) -> str:
    """Return an axis in words: "z", "-y", or its three numbers."""
    for name, along in _AXES.items():
        for sign, factor in (("", 1.0), ("-", -1.0)):
            if all(abs(a - factor * b) < 1e-3 for a, b in zip(axis, along, strict=True)):
                return f"{sign}{name}"
    return " ".join(f"{one:.3g}" for one in axis)


def _style(joint: BodyJoint) -> str:
    return _MOVES if joint.moves else _FLOATS if joint.kind in FLOATING else _FIXED


def _label(*lines: str) -> str:
    """Return lines as a text in DOT, whose backslashes and entities would mean something else."""
    escaped = (plain(one).replace("&", "&amp;").replace("\\", "\\\\").replace('"', '\\"') for one in lines)
    return '"' + "\\n".join(escaped) + '"'
