"""The body as text: its links and joints, and the tree that they form."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rbxcompose.body.model import Body, BodyJoint, BodyLink

LINKS = ("link", "on", "by", "mass", "shapes")
JOINTS = ("joint", "type", "from", "to", "effort", "speed")


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
    return ", ".join(one.geometry.file or one.geometry.kind for one in link.visuals)


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
