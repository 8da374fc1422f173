"""What cameras see of a world: depths are those of rays, and every picture is one that a real camera could take."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, TypeVar

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2, Transform3, quaternion_from_yaw
from rbxcompose.domains.worlds.grid_map import GridMap
from rbxcompose.domains.worlds.optics import TO_OPTICAL, Intrinsics
from rbxcompose.domains.worlds.physics.looks import DepthPicture
from rbxcompose.domains.worlds.shapes import ShapePath, WorldBox, WorldCylinder, WorldHole, WorldLight, WorldShape
from rbxcompose.domains.worlds.view import Lens, WorldView
from rbxcompose.domains.worlds.world import SimulatedWorld
from rbxcompose.msgs.sensor_msgs import CameraInfo, Image, PointCloud2
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.types import Message
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance
from tests.worlds.scenes import ANGLES, grids, shapes

M = TypeVar("M", bound=Message)
CAMERA = Intrinsics.of_view(161, 121, math.radians(70))
MIDDLE = 60  # the row that is level
HEIGHT = 0.3


def optical(x: float, y: float, heading: float, z: float = HEIGHT, camera: Transform3 = TO_OPTICAL) -> Transform3:
    return Transform3((x, y, z), quaternion_from_yaw(heading)).compose(camera)


def shot(world: SimulatedWorld, x: float = 0, y: float = 0, heading: float = 0, time: float = 0) -> DepthPicture:
    return WorldView(world).seen(optical(x, y, heading), CAMERA, time, 50.0)


@settings(max_examples=4 * settings().max_examples)
@given(grids(), shapes(), st.floats(-2, 2), st.floats(-2, 2), ANGLES)
def test_depths_are_those_of_the_laser(
    grid: GridMap, found: tuple[WorldShape, ...], x: float, y: float, heading: float
) -> None:
    world = SimulatedWorld("", grid, found)
    slopes = (CAMERA.cx - np.arange(CAMERA.width)) / CAMERA.fx
    distances = world.distances((x, y), heading + np.arctan(slopes), 20.0, 0.0, HEIGHT)
    if not distances.min() > 0.1:
        return  # it is inside of something, or nearer than cameras see
    expected = distances / np.hypot(1, slopes)
    depths = shot(world, x, y, heading).depths[MIDDLE]
    round_ = 0.04 if any(isinstance(shape.solid, WorldCylinder) for shape in found) else 1e-4  # drawn with 24 sides
    with np.errstate(invalid="ignore"):
        differs = ~((np.abs(depths - expected) <= round_ * np.maximum(1, expected)) | (depths == expected))
    edges = np.abs(np.diff(np.nan_to_num(expected, posinf=30), prepend=expected[0])) > 0.02
    near_edge = np.convolve(edges, np.ones(5), "same") > 0  # pixels that a face covers in part
    assert (differs & ~near_edge & np.isfinite(expected)).sum() <= 6  # faces seen from their edge cover half pixels


def test_each_pixel_of_the_ground_is_as_far_as_it_is_low() -> None:
    depths = shot(SimulatedWorld()).depths
    rows = np.arange(MIDDLE + 8, CAMERA.height)
    assert depths[rows, 80] == pytest.approx(HEIGHT * CAMERA.fy / (rows - CAMERA.cy), rel=1e-3)
    assert np.isinf(depths[: MIDDLE - 1]).all()


def test_things_have_their_colours_wherever_they_are_seen_from() -> None:
    box = WorldShape("box", WorldBox((0.4, 0.4, 0.6)), Pose2(2, 0))
    can = WorldShape("can", WorldCylinder(0.2, 0.6), Pose2(2, 5))
    world = SimulatedWorld("", shapes=(box, can), colours=("red", "blue"))
    for angle in np.linspace(0, math.tau, 9):
        view = shot(world, 2 - 2 * math.cos(angle), -2 * math.sin(angle), float(angle))
        red, green, blue = view.colours[MIDDLE, 80].astype(int)
        assert red > 2 * max(green, blue)
    red, green, blue = shot(world, 0, 5).colours[MIDDLE, 80].astype(int)
    assert blue > red


def test_a_thing_that_moves_is_where_it_is_at_the_time() -> None:
    path = ShapePath(((0, 2, 0), (10, 2, 5)))
    world = SimulatedWorld("", shapes=(WorldShape("cart", WorldBox((0.4, 0.4, 0.6)), Pose2(2, 0), path=path),))
    assert shot(world).depths[MIDDLE, 80] == pytest.approx(1.8)
    assert np.isinf(shot(world, time=10).depths[MIDDLE, 80])


def test_a_hole_is_dark() -> None:
    hole = WorldHole("stairs", ((1, -1), (2, -1), (2, 1), (1, 1)))
    dark, ground = (shot(replace(SimulatedWorld(), holes=holes)).colours for holes in ((hole,), ()))
    row = round(CAMERA.cy + HEIGHT / 1.5 * CAMERA.fy)
    assert dark[row, 80].sum() < ground[row, 80].sum() / 2


def test_a_lamp_makes_bright_what_faces_it_in_its_colour() -> None:
    box = WorldShape("box", WorldBox((0.4, 4, 0.6)), Pose2(2, 0))
    world = SimulatedWorld("", shapes=(box,), colours=("white",))
    dark = shot(replace(world, lights=(WorldLight("lamp", (4, 0, 1), "white", 1.0),))).colours[MIDDLE, 80].astype(int)
    red = shot(replace(world, lights=(WorldLight("lamp", (0, 0, 1), "#ff0000", 0.5),))).colours[MIDDLE, 80].astype(int)
    assert dark == pytest.approx([dark[0]] * 3)
    assert red[0] > 1.4 * dark[0]
    assert red[1:] == pytest.approx(dark[1:], abs=1)


@pytest.mark.parametrize(
    "bent",
    [
        Intrinsics.of_view(161, 121, math.radians(70), (-0.2, 0.03, 0.001, -0.002)),
        Intrinsics(161, 121, 110, 130, 90, 50),
        Intrinsics(161, 121, 110, 130, 90, 50, (-0.1, 0.03, 0.001, -0.002, 0.0, 0.05, -0.02, 0.01)),
    ],
)
def test_a_lens_bends_pictures_as_it_bends_points(bent: Intrinsics) -> None:
    box = WorldShape("box", WorldBox((0.2, 0.6, 0.6)), Pose2(1.6, 0.1))
    view = WorldView(SimulatedWorld("", shapes=(box,), colours=("red",))).seen(optical(0, 0, 0), bent.unbent, 0, 50)
    colours, depths = Lens(bent).bent(view.colours, view.depths)
    assert depths.shape == (121, 161)
    rows, columns = np.nonzero(colours[:, :, 0] > 2 * colours[:, :, 1].astype(int))
    corners = np.array([(y, z, 1.5) for y in (-0.4, 0.2) for z in (-0.3, 0.3)])  # of its front, in the optical frame
    seen, _ = cv2.projectPoints(corners, np.zeros(3), np.zeros(3), bent.matrix, bent.coefficients)
    at = seen.reshape(-1, 2)
    assert (columns.min(), columns.max()) == pytest.approx((at[:, 0].min(), at[:, 0].max()), abs=1.5)
    assert (rows.min(), rows.max()) == pytest.approx((at[:, 1].min(), at[:, 1].max()), abs=1.5)
    rays = bent.rays[::10, ::10].reshape(-1, 3)
    again, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), bent.matrix, bent.coefficients)
    places = np.stack(np.meshgrid(np.arange(0, 161, 10), np.arange(0, 121, 10)), -1).reshape(-1, 2)
    assert again.reshape(-1, 2) == pytest.approx(places, abs=0.01)


def test_a_lens_that_cannot_be_is_refused() -> None:
    for distortion in ([-5.0, 0, 0, 0], [1e9, 0, 0, 0], [-0.9, 3.0, 0, 0, -9.0]):
        with pytest.raises(ValueError, match="no lens bends"):
            instance("camera", "camera_sim", {"distortion": distortion, "view": "120 deg"})
    with pytest.raises(ValueError, match="no lens bends"):
        instance("camera", "camera_sim", {"pinhole": [200.0, 200.0, 5000.0, 120.0]})
    for pinhole in ([200.0], [0.0, 200.0, 160.0, 120.0]):
        with pytest.raises(ValueError, match="it is fx, fy, cx and cy"):
            instance("camera", "camera_sim", {"pinhole": pinhole})


@pytest.mark.parametrize("sensor", ["laser_sim", "camera_sim", "lidar"])
def test_a_sensor_that_sees_nothing_is_refused_also_with_what_it_has_by_default(sensor: str) -> None:
    given = {"port": "/dev/ttyUSB0"} if sensor == "lidar" else {}
    for ranges in ({"nearest": "9 m", "farthest": "8 m"}, {"nearest": "20 m"}, {"farthest": "1 cm"}):
        with pytest.raises(ValueError, match="'farthest' must be more than 'nearest'"):
            instance("eye", sensor, {**given, **ranges})


class Seeing:
    """A camera on a base that stands before a box, and far from a tower."""

    def __init__(self, **config: object) -> None:
        objects = {
            "box": {"box": ["20 cm", "80 cm", "80 cm"], "at": {"x": "1.6 m"}, "colour": "red"},
            "tower": {"box": ["4 m", "4 m", "40 m"], "at": {"x": "62 m", "y": "20 m"}},
        }
        self.bench = Bench(
            instance("world", "world", {"name": "test", "objects": objects}),
            instance("base", "diff_drive_sim", {"in_world": True}),
            instance("camera", "camera_sim", {"frame": "base_footprint", "size": [80, 60], **config}),
        )

    def taken(self, topic: str, kind: type[M], seconds: float = 1.0) -> list[M]:
        found = self.bench.collect(topic, kind)
        self.bench.advance(seconds)
        return found


def numbers(image: Image) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    return np.frombuffer(image.data, np.float32).reshape(image.height, image.width)


def test_it_publishes_pictures_as_a_camera_of_ros_does() -> None:
    seeing = Seeing(depth=True, farthest="5 m")
    infos = seeing.bench.collect("/camera/camera_info", CameraInfo)
    depths = seeing.bench.collect("/camera/depth/image_raw", Image)
    clouds = seeing.bench.collect("/camera/points", PointCloud2)
    pictures = seeing.taken("/camera/image_raw", Image)
    assert len(pictures) == len(depths) == len(clouds) == pytest.approx(10, abs=1)
    picture, info = pictures[-1], infos[-1]
    assert (picture.header.frame_id, picture.encoding) == ("base_footprint_optical_frame", "rgb8")
    assert (info.width, info.height) == (picture.width, picture.height) == (80, 60)
    camera = Intrinsics.of_message(info)
    known = numbers(depths[-1])
    assert known[20, 40] == pytest.approx(1.5, abs=1e-3)
    assert known[10, 2] == math.inf  # beside the box
    rows = np.frombuffer(clouds[-1].data, np.float32).reshape(60, 80, 4)
    at = rows[20, 30, :3]
    assert at[2] == pytest.approx(known[20, 30])
    assert at[:2] / at[2] * (camera.fx, camera.fy) + (camera.cx, camera.cy) == pytest.approx((30, 20), abs=1e-3)
    assert np.isnan(rows[10, 2, :3]).all()


def test_nothing_is_drawn_that_nobody_wants(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[float] = []
    whole = WorldView.seen

    def seen(view: WorldView, *wanted: Any) -> DepthPicture:
        drawn.append(wanted[2])
        return whole(view, *wanted)

    monkeypatch.setattr(WorldView, "seen", seen)
    seeing = Seeing()
    seeing.bench.advance(2)
    assert not drawn
    seeing.taken("/camera/image_raw", Image)
    assert drawn


def test_noise_is_as_large_as_it_says_and_the_same_again() -> None:
    def depths() -> list[Image]:
        return Seeing(depth=True, noise="1 cm", grain=5).taken("/camera/depth/image_raw", Image)

    first, again = depths(), depths()
    assert [bytes(one.data) for one in first] == [bytes(one.data) for one in again]
    on_box = np.concatenate([numbers(one)[10:30, 35:45].ravel() for one in first])
    assert on_box.mean() == pytest.approx(1.5, abs=2e-3)
    assert on_box.std() == pytest.approx(0.01 * 1.5**2, rel=0.1)
    assert np.isposinf(numbers(first[-1])[0, :5]).all()  # REP 117: beside the box, above the horizon


@pytest.mark.parametrize(("farthest", "depth"), [("50 m", math.inf), ("100 m", 60.0)])
def test_depths_reach_as_far_as_it_says(farthest: str, depth: float) -> None:
    seen = numbers(Seeing(depth=True, farthest=farthest).taken("/camera/depth/image_raw", Image)[-1])
    assert seen[10, 17] == pytest.approx(depth)


def test_pictures_that_nobody_wants_count_once_each_in_diagnostics() -> None:
    seeing = Seeing(depth=True)
    found = [seeing.bench.statuses(f"camera: camera/{topic}") for topic in ("image_raw", "points")]
    seeing.taken("/camera/depth/image_raw", Image, 5.0)
    assert [statuses[-1].message for statuses in found] == ["10 Hz", "10 Hz"]


def test_pictures_come_as_late_as_they_say_with_the_time_when_they_were_taken() -> None:
    seeing = Seeing(latency="250 ms")
    arrived: list[tuple[float, float]] = []
    seeing.bench.bus.subscribe(
        "me",
        "/camera/image_raw",
        Image,
        Qos.BULK,
        lambda image: arrived.append((seeing.bench.clock.now(), to_nanoseconds(image.header.stamp) / 1e9)),
    )
    seeing.bench.advance(1)
    first, last = arrived[0], arrived[-1]
    assert last[0] - first[0] == pytest.approx(last[1] - first[1], abs=1e-6)
    assert arrived
    offset = seeing.bench.clock.stamp() / 1e9 - seeing.bench.clock.now()
    assert {round(now - (stamp - offset), 3) for now, stamp in arrived} == {0.25}
