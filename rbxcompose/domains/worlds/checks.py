"""Rules about worlds."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.findings import Finding
from rbxcompose.base.units import LENGTH, format_quantity
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.domains.worlds.sections.world import world

DEEP = 0.01  # [m] in which a robot may begin: places are not measured better


@check("RBX3611")
def start_in_something(robot: Robot) -> Iterator[Finding]:
    """The robot starts in a wall or in a thing of its world."""
    contents = robot.manifest.contents
    if "world" not in contents.root or not contents.is_simulated or (found := contents.of(world)) is None:
        return
    from rbxcompose.domains.worlds.contact import MAP, overlap  # imports numpy
    from rbxcompose.domains.worlds.shapes import CircleFootprint

    depth, what = overlap(found.file.grid, found.solid_at(0.0), CircleFootprint(found.radius), found.start)
    if depth > DEEP:
        within = "a wall" if what == MAP else f"'{what}'"
        yield start_in_something.at(
            robot.value("world", "spawn"),
            f"the robot starts {format_quantity(round(depth, 2), LENGTH)} deep in {within} of '{found.file.name}'",
            help=f"move its 'spawn', or choose another: it has a radius of {format_quantity(found.radius, LENGTH)}",
        )
