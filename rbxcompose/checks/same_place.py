"""Two places with the same pose."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot


@check("RBX3506", Severity.WARNING, closed=("places",))
def same_place(robot: Robot) -> Iterator[Finding]:
    """Two places have the same pose."""
    first: dict[tuple[float, float, float], str] = {}
    for name, place in robot.manifest.places.items():
        other = first.setdefault((place.x, place.y, place.heading), name)
        if other != name:
            yield same_place.at(
                robot.key("places", name),
                f"the places '{other}' and '{name}' are at the same spot",
                help="change or remove one of them",
                related=[Related(robot.key("places", other), "the other one")],
            )
