"""The body as text and as a graph: its links and joints, and the tree that they form."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rbxcompose.base.geometry import Vector3
from rbxcompose.base.printable import plain
from rbxcompose.commands.layout import graphviz
from rbxcompose.domains.body.model import FLOATING, Body, BodyJoint, BodyLink

LINKS = ("link", "on", "by", "mass", "shapes")
JOINTS = ("joint", "type", "from", "to", "effort", "speed")
FORMATS = ("svg", "pdf")
_MOVES = 'color="#1f6feb" fontcolor="#1f6feb" penwidth=2.2'
_FIXED = 'color="#6e7781" fontcolor="#6e7781"'
_FLOATS = f"{_FIXED} style=dashed"
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def extent_of(body: Body) -> str:
    """Return how many links and moving joints a body has, and its mass, in words."""
    links, joints = len(body.links), len(body.moving)
    joints_words = "1 joint that moves" if joints == 1 else f"{joints} joints that move"
    return f"{links} link{'' if links == 1 else 's'}, {joints_words}, {mass_of(body):.4g} kg"


def mass_of(body: Body) -> float:
    """Return the mass of all links [kg]."""
    return sum(link.inertial.mass for link in body.links.values() if link.inertial)


def links_of(body: Body) -> Iterator[tuple[str, ...]]:
    """Yield a row of `LINKS` for each link, the root first."""
    for name, _ in body.walk():
        link, above = body.links[name], body.joint_above.get(name)
        mass = f"{link.inertial.mass:.4g} kg" if link.inertial else ""
        yield name, above.parent if above else "", above.name if above else "", mass, shapes_of(link)


def shapes_of(link: BodyLink) -> str:
    """Return what a link looks like, in words."""
    return ", ".join(visual.geometry.file or visual.geometry.kind for visual in link.visuals)


def joints_of(body: Body) -> Iterator[tuple[str, ...]]:
    """Yield a row of `JOINTS` for each joint that moves."""
    for joint in body.joints.values():
        if joint.moves:
            limits = joint.limits
            turns = joint.kind != "prismatic"
            lower, upper = (limits.lower, limits.upper) if limits and joint.kind != "continuous" else (None, None)
            yield (
                joint.name,
                f"{joint.kind}, mimics {joint.mimic.joint}" if joint.mimic else joint.kind,
                _amount(lower, "deg" if turns else "m"),
                _amount(upper, "deg" if turns else "m"),
                _amount(limits.effort if limits else None, "Nm" if turns else "N"),
                _amount(limits.velocity if limits else None, "deg/s" if turns else "m/s"),
            )


def tree_of(body: Body) -> Iterator[str]:
    """Yield a line for each link, indented by its depth, with the joint that it hangs on."""
    for name, depth in body.walk():
        joint = body.joint_above.get(name)
        yield f"{'  ' * depth}{name}{f'  ({_hinge(joint)})' if joint else ''}"


def _hinge(joint: BodyJoint) -> str:
    return joint.name if joint.kind == "fixed" else f"{joint.name}: {joint.kind}"


def _amount(value: float | None, unit: str) -> str:
    if value is None:
        return ""
    return f"{math.degrees(value):.4g} {unit}" if unit.startswith("deg") else f"{value:.4g} {unit}"


def draw_graph(body: Body, form: str) -> bytes:
    """Return the graph of a body in one of `FORMATS`.

    Raises:
        NotDoneError: if Graphviz is not installed.
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
    return " ".join(f"{value:.3g}" for value in axis)


def _style(joint: BodyJoint) -> str:
    return _MOVES if joint.moves else _FLOATS if joint.kind in FLOATING else _FIXED


def _label(*lines: str) -> str:
    """Return lines as a text in DOT, whose backslashes and entities would mean something else."""
    escaped = (plain(line).replace("&", "&amp;").replace("\\", "\\\\").replace('"', '\\"') for line in lines)
    return '"' + "\\n".join(escaped) + '"'
