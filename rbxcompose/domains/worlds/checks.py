"""Rules about worlds."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.findings import Finding
from rbxcompose.base.geometry import Pose2
from rbxcompose.base.units import LENGTH, format_quantity
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.domains.worlds.contact import MAP, in_polygon, overlap
from rbxcompose.domains.worlds.sections.world import world
from rbxcompose.sdk.capabilities import Drives

DEEP = 0.01  # [m] in which a robot may begin: places are not measured better


@check("RBX3611")
def start_in_something(robot: Robot) -> Iterator[Finding]:
    """The robot starts in a wall or in a thing of its world, above a hole, or outside of the map."""
    contents = robot.manifest.contents
    if "world" not in contents.root or not contents.is_simulated or (found := contents.of(world)) is None:
        return
    from rbxcompose.domains.worlds.shapes import CircleFootprint

    if found.file.map is not None and not found.file.grid.contains((found.start.x, found.start.y)):
        place = ", ".join(format_quantity(value, LENGTH) for value in (found.start.x, found.start.y))
        yield start_in_something.at(
            robot.value("world", "spawn"),
            f"the robot starts outside of the map of '{found.file.name}': at ({place})",
            help="move its 'spawn' onto the map, or choose another",
        )
    depth, what = overlap(found.file.grid, found.solid_at(0.0), CircleFootprint(found.radius), found.start)
    if depth > DEEP:
        within = "a wall" if what == MAP else f"'{what}'"
        yield start_in_something.at(
            robot.value("world", "spawn"),
            f"the robot starts {format_quantity(round(depth, 2), LENGTH)} deep in {within} of '{found.file.name}'",
            help=f"move its 'spawn', or choose another: it has a radius of {format_quantity(found.radius, LENGTH)}",
        )
    tracks = [base.wheel_distance.value for _, base in robot.declared(Drives) if base.wheel_distance]
    points = [found.start.compose(Pose2(0.0, side * track / 2)) for track in (0.0, *tracks) for side in (-1, 1)]
    for name, hole in found.file.holes.items():
        if in_polygon(hole.area, [at.x for at in points], [at.y for at in points]).any():
            yield start_in_something.at(
                robot.value("world", "spawn"),
                f"the robot starts where it has no ground: above the hole '{name}' of '{found.file.name}'",
                help="move its 'spawn', or choose another",
            )
