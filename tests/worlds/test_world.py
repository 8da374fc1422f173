"""A world with many things, of which few are near."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2, Transform3
from rbxcompose.base.transforms import TransformError
from rbxcompose.domains.worlds.contact import first_contact
from rbxcompose.domains.worlds.grid_map import GridMap
from rbxcompose.domains.worlds.ray_casting import Rays
from rbxcompose.domains.worlds.shapes import CircleFootprint, ShapePath, WorldShape
from rbxcompose.domains.worlds.world import SimulatedWorld
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk.bound import LATE, NewestMessage
from tests.parts.project import Project
from tests.worlds.scenes import ANGLES, HEIGHT, grids, shapes

SOME_ANGLES = np.linspace(-3.0, 3.0, 17)
PLACES = st.floats(-2, 2)


@given(grids(), shapes(), PLACES, PLACES, ANGLES, st.booleans(), st.floats(0, 5), st.floats(0.1, 4), st.floats(0, 1))
def test_what_is_far_away_changes_nothing(
    grid: GridMap,
    found: tuple[WorldShape, ...],
    x: float,
    y: float,
    heading: float,
    moves: bool,
    time: float,
    most: float,
    z: float,
) -> None:
    path = ShapePath(((0.0, x, y), (2.0, x + 1, y - 1)))
    if moves and found:
        found = (replace(found[0], path=path), *found[1:])
    world = SimulatedWorld("", grid, found, height=HEIGHT)
    everything = [shape.at(time) for shape in found]
    seen = world.distances((x, y), SOME_ANGLES, most, time, z)
    assert seen.tolist() == Rays(grid).cast((x, y), SOME_ANGLES, most, everything, z).tolist()
    before, after = Pose2(x, y, heading), Pose2(x + 0.3, y - 0.1, heading)
    touched, expected = (
        world.first_contact(before, after, time),
        first_contact(grid, everything, CircleFootprint(world.radius), before, after),
    )
    assert (touched is None) == (expected is None)
    if touched and expected:
        assert (touched.part, touched.pose) == (expected.part, expected.pose)


@given(grids(), shapes(), PLACES, PLACES)
def test_a_ray_ends_at_the_nearest_of_all_shapes(
    grid: GridMap, found: tuple[WorldShape, ...], x: float, y: float
) -> None:
    rays = Rays(grid)
    alone = [rays.cast((x, y), SOME_ANGLES, 4.0, [shape], 0.1) for shape in found]
    nearest = np.min([rays.cast((x, y), SOME_ANGLES, 4.0), *alone], 0)
    assert rays.cast((x, y), SOME_ANGLES, 4.0, found, 0.1).tolist() == nearest.tolist()


def test_a_world_with_more_things_than_a_robot_needs_is_refused_with_the_reason(tmp_path: Path) -> None:
    things = "".join(f"  thing_{i}: {{shape: person, at: {{x: {i} m}}}}\n" for i in range(1, 2000))
    tmp_path.joinpath("many.yaml").write_text(f"rbx: 1\nkind: World\nname: many\nobjects:\n{things}", encoding="utf-8")
    checked = Project(tmp_path).check("world: ../../many.yaml\ncomponents:\n  base: {type: diff_drive_sim}\n")
    assert checked.compilation.plan is None
    assert "more than 1,000 keys in one map" in checked.text


class Placed:
    """A frame whose pose is known up to a stamp [ns]."""

    known = 0

    def now(self, *, within: float = 0.0) -> Pose2:
        return Pose2()

    def transform(self, *, at: int | None = None) -> Transform3:
        if at is not None and at > self.known:
            raise TransformError("it is not known yet")
        return Transform3()

    def newest(self) -> int:
        return self.known


def test_a_transform_that_comes_a_little_late_is_no_problem_unless_none_comes() -> None:
    newest, look, taken = NewestMessage[LaserScan](), Placed(), 0
    for cycle in range(1, 41):  # a scan each 50 ms, and transforms 20 ms later, until none come any more
        now = cycle * 0.05
        newest.put(LaserScan(Header(stamp=to_time(round(now * 1e9)))))
        for time in (now, now + 0.03):
            look.known = round(min(time - 0.02, 1.0) * 1e9)
            taken += newest.take(time, look) is not None
            assert newest.problem == ("" if time < 1.049 + LATE else "it is not known yet")
    assert taken == 20
    look.known = 1 << 60
    assert newest.take(3.0, look)
    assert newest.problem == ""
