"""Tags on things of a world: cameras of both simulators see them where they are."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from rbxcompose.base.geometry import Pose2, Transform3, quaternion_from_yaw
from rbxcompose.domains.vision.tags import SeenTag, TagFinder
from rbxcompose.domains.worlds.optics import TO_OPTICAL, Intrinsics
from rbxcompose.domains.worlds.shapes import ShapePath, WorldBox, WorldShape
from rbxcompose.domains.worlds.tag_pictures import tag_on
from rbxcompose.domains.worlds.view import WorldView
from rbxcompose.domains.worlds.world import SimulatedWorld
from rbxcompose.msgs.poses import pose_of
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.vision_msgs import Detection3DArray
from tests.navigation.test_eyes import LEVEL
from tests.navigation.test_robot import Room
from tests.navigation.test_sensors import skip_without_pictures
from tests.parts.project import Project
from tests.soak import rare

cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed")
CAMERA = Intrinsics.of_view(640, 480, math.radians(60))
SIDES = ("front", "left", "back", "right")


def seen(world: SimulatedWorld, at: Transform3, sizes: dict[int, float]) -> list[SeenTag]:
    view = WorldView(world).seen(at.compose(TO_OPTICAL), CAMERA, 0.0, 50.0)
    return TagFinder(sizes=sizes).find(cv2.cvtColor(view.colours, cv2.COLOR_RGB2GRAY), CAMERA)


@pytest.mark.parametrize("index", range(4))
def test_each_side_of_a_box_shows_its_tag(index: int) -> None:
    heading = 0.3
    box = WorldBox((0.5, 0.4, 0.6))
    tags = tuple(tag_on(box, side, 20 + number) for number, side in enumerate(SIDES))
    crate = WorldShape("crate", box, Pose2(1.0, 2.0, heading), tags=tags)
    bearing = heading + index * math.pi / 2 + 0.2
    at = Transform3(
        (1 + 1.5 * math.cos(bearing), 2 + 1.5 * math.sin(bearing), 0.4), quaternion_from_yaw(bearing + math.pi)
    )
    found = {
        tag.number: tag for tag in seen(SimulatedWorld(shapes=(crate,)), at, {20 + n: tags[n].size for n in range(4)})
    }
    tag = found[20 + index]
    placed = Transform3((1.0, 2.0, 0.0), quaternion_from_yaw(heading)).compose(tags[index].place)
    truth = at.compose(TO_OPTICAL).inverse().compose(placed)
    assert tag.pose is not None
    off = tag.pose.inverse().compose(truth)
    assert math.hypot(*off.translation) < 0.01
    assert 2 * math.acos(min(1.0, abs(off.rotation[3]))) < math.radians(2)


@pytest.mark.parametrize(
    ("thing", "why"),
    [
        ("box: [10 cm, 10 cm, 10 cm], tags: {front: {number: 3, size: 9 cm}}", "does not fit on 'front', 10 x 10 cm"),
        ("box: [10 cm, 10 cm, 10 cm], tags: {left: {number: 3, size: 5 cm, up: 3 cm}}", "does not fit on 'left'"),
        ("box: [10 cm, 10 cm, 10 cm], tags: {front: 587}", "tag36h11 has the tags 0 to 586, and no 587"),
        ("box: [10 cm, 10 cm, 10 cm], tags: {frnt: 3}", "did you mean 'front'?"),
        ("box: [10 cm, 10 cm, 10 cm], tags: {side: 3}", "front, back, left, right, top"),
        ("mesh: chair.stl, tags: {front: 3}", "a mesh has no flat sides for tags"),
        ("box: [10 cm, 10 cm, 10 cm], turns: true", "what 'turns' has a 'path'"),
    ],
)
def test_a_tag_that_cannot_be_there_is_refused_with_the_reason(tmp_path: Path, thing: str, why: str) -> None:
    (tmp_path / "world.yaml").write_text(f"rbx: 1\nkind: World\nname: room\nobjects:\n  it: {{{thing}}}\n")
    said = Project(tmp_path).check("world: ../../world.yaml\n").text
    assert why in said
    assert "world.yaml:5:" in said


def test_who_turns_faces_where_it_goes_also_while_it_waits() -> None:
    path = ShapePath(((0.0, 0.0, 0.0), (1.0, 1.0, 0.0), (2.0, 1.0, 0.0), (3.0, 1.0, 2.0)), turns=True)
    headings = [path.heading_at(time, 9.0) for time in (-1.0, 0.5, 1.5, 2.5, 8.0)]
    assert headings == pytest.approx([0.0, 0.0, 0.0, math.pi / 2, math.pi / 2])
    assert ShapePath(path.points).heading_at(0.5, 9.0) == 9.0


ROBOT = """body: {urdf: eye.urdf}
world: ../../room.yaml
simulator: SIMULATOR
cameras:
  front: {frame: camera_link, size: [320, 240], rate: 10 Hz}
tags: {size: 16 cm, names: {walker: 7}, sizes: {walker: 24 cm}}
components:
  base: {type: diff_drive_sim}
"""
WORLD = """rbx: 1
kind: World
name: room
objects:
  crate: {box: [30 cm, 30 cm, 40 cm], at: {x: 2 m, y: 60 cm, heading: 180 deg}, tags: {front: {number: 3, size: 16 cm}}}
  loose: {box: [20 cm, 20 cm, 40 cm], at: {x: 2 m, y: -50 cm}, mass: 1 kg, tags: {back: 4}}
  visitor:
    shape: person
    path: [[0 s, 1.5 m, 0 m], [4 s, 3.1 m, 0 m]]
    turns: true
    tags: {back: {number: 7, size: 24 cm, up: -45 cm}}
"""


@pytest.mark.parametrize("simulator", ["physics", *rare("ideal")])
def test_a_camera_sees_tags_of_what_stands_what_is_loose_and_who_walks(tmp_path: Path, simulator: str) -> None:
    (tmp_path / "robots/one").mkdir(parents=True)
    (tmp_path / "robots/one/eye.urdf").write_text(LEVEL)
    bench = Room(tmp_path, ROBOT.replace("SIMULATOR", simulator), WORLD).bench
    taken = bench.collect("/tags", Detection3DArray)
    bench.advance(1.2)
    skip_without_pictures(bench, simulator, taken)
    first, last = (
        {one.id: pose_of(one.bbox.center).translation for one in array.detections} for array in taken[:: len(taken) - 1]
    )
    assert first.keys() == last.keys() == {"3", "4", "walker"}
    assert first["3"] == pytest.approx((-0.6, 0.2, 1.67), abs=0.03)
    assert first["3"] == pytest.approx(last["3"], abs=0.01)
    passed = (to_nanoseconds(taken[-1].header.stamp) - to_nanoseconds(taken[0].header.stamp)) / 1e9
    assert last["walker"][2] - first["walker"][2] == pytest.approx(0.4 * passed, abs=0.08)
