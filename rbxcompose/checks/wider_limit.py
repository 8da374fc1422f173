"""A limit of a joint that the body does not grant."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.driven_joints import ROUNDED, DrivenJoint, driven_joints
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING
from rbxcompose.sections.joints import limits_of

_KEYS: dict[str, tuple[str | int, ...]] = {
    "lower": ("position", 0),
    "upper": ("position", 1),
    "velocity": ("velocity",),
}
_WORDS = {"lower": "least position", "upper": "greatest position", "velocity": "largest speed"}


@check("RBX2223", Severity.WARNING, closed=(WIRING,))
def wider_limit(robot: Robot) -> Iterator[Finding]:
    """A limit of a joint is wider than that of the body."""
    for one in driven_joints(robot):
        for name in limits_of(one.written, one.body).wider:
            yield from _told(one, name)


def _told(one: DrivenJoint, name: str) -> Iterator[Finding]:
    limits, body = one.written.limits, one.body.limits if one.body else None
    outer: float | None = getattr(body, name, None)
    wanted = limits.velocity if name == "velocity" else limits.position and limits.position[name == "upper"]
    if name == "velocity" and outer == 0.0:
        return  # the body's zero is the mistake, which is told there
    if body is None or outer is None or not wanted or abs(wanted.value - outer) <= ROUNDED * abs(outer):
        return
    shown = one.speed if name == "velocity" else one.position
    yield wider_limit.at(
        one.value("limits", *_KEYS[name]),
        f"the {_WORDS[name]} of '{one.name}' is {shown(wanted.value)}, and the body's limit of {shown(outer)} holds",
        help="leave it out, or change the URDF if the joint can do more",
        related=[Related(body.span, "the limit of the body")],
    )
