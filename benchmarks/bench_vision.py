"""Seeing: how long pictures and tags take, and how well tags are found."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from benchmarks.bench_robot import up
from benchmarks.bus_ends import Ours
from benchmarks.measuring import Row, Samples, timed
from benchmarks.peers import free_port
from rbxcompose.base.arrays import Bytes
from rbxcompose.base.geometry import Pose2, Transform3, quaternion_from_yaw
from rbxcompose.domains.vision.tags import TagFinder
from rbxcompose.domains.worlds.optics import TO_OPTICAL, Intrinsics
from rbxcompose.domains.worlds.shapes import WorldBox, WorldShape
from rbxcompose.domains.worlds.tag_pictures import tag_on
from rbxcompose.domains.worlds.view import WorldView
from rbxcompose.domains.worlds.world import SimulatedWorld
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.vision_msgs import Detection3DArray
from rbxcompose.sdk.ports import Qos

MEASURES = ("rbxcompose/domains/vision", "rbxcompose/domains/worlds")

CAMERA = Intrinsics.of_view(640, 480, math.radians(60))
SIZE, SEEN = 0.15, 7  # side of a tag [m], and its number
VIEWS, NOISE = 1000, 3.0  # pictures, and the standard deviation of their greys
WATCHED = 100  # pictures that a robot takes
ROBOT = """rbx: 1
kind: Robot
name: watcher
world: world.yaml
bus: {{port: {port}}}
components:
  base: {{type: diff_drive_sim}}
cameras:
  camera: {{frame: base_footprint, size: [640, 480], rate: 10 Hz}}
tags: {{size: 15 cm}}
"""
WORLD = """rbx: 1
kind: World
name: crate
objects: {crate: {box: [20 cm, 20 cm, 20 cm], at: {x: 1 m}, tags: {back: {number: 7, size: 15 cm}}}}
"""


def rows() -> list[Row]:
    """Return the figures of seeing."""
    return [*_pictures(), *_views(), _through_the_bus()]


def _world(count: int) -> SimulatedWorld:
    """Return a wall of boxes with tags, seen from the origin along x."""
    box = WorldBox((0.2, 0.19, 0.19))
    shapes = []
    for number in range(count):
        column, row = number % 5, number // 5
        place = Pose2(1.5, (2 - column) * 0.22) if count > 1 else Pose2(1.0, 0.0)
        shapes.append(WorldShape(f"box_{number}", box, place, 0.21 * row, tags=(tag_on(box, "back", number),)))
    return SimulatedWorld(shapes=tuple(shapes))


def _grey(view: WorldView, at: Transform3) -> Bytes:
    colours = view.seen(at.compose(TO_OPTICAL), CAMERA, 0.0, 50.0).colours
    return np.asarray(cv2.cvtColor(colours, cv2.COLOR_RGB2GRAY), np.uint8)


def _pictures() -> Iterator[Row]:
    at = Transform3((0.0, 0.0, 0.2))
    for count, name in ((1, "a tag"), (10, "ten tags")):
        view, finder = WorldView(_world(count)), TagFinder(size=SIZE)
        drawn = timed(partial(_grey, view, at), 100)
        how = "640 x 480 pixels, tags on boxes on the ground"
        yield Row(f"vision: a picture with {name}", "ms", how, drawn.median * 1e3, drawn.p99 * 1e3, most=10.0)
        picture = _grey(view, at)
        if len(finder.find(picture, CAMERA)) != count:
            raise ValueError(f"not all of {name} are found")
        found = timed(partial(finder.find, picture, CAMERA), 100)
        how = "640 x 480 pixels, with poses and covariances; OpenCV"
        yield Row(f"vision: finding {name}", "ms", how, found.median * 1e3, found.p99 * 1e3, most=15.0)


def _views() -> Iterator[Row]:
    random = np.random.default_rng(1)
    box = WorldBox((0.3, 0.3, 0.3))
    tag = tag_on(box, "front", SEEN, size=SIZE)
    view = WorldView(SimulatedWorld(shapes=(WorldShape("crate", box, Pose2(), tags=(tag,)),)))
    finder, errors, false = TagFinder(size=SIZE), list[float](), 0
    for _ in range(VIEWS):
        distance, angle = random.uniform(0.5, 3.0), random.uniform(-math.pi / 3, math.pi / 3)
        turned = quaternion_from_yaw(angle + math.pi + random.uniform(-0.25, 0.25))
        beside = 0.15 + distance * math.cos(angle), distance * math.sin(angle), random.uniform(0.1, 0.3)
        at = Transform3(beside, turned)
        picture = np.clip(_grey(view, at) + random.normal(0.0, NOISE, (480, 640)), 0, 255).astype(np.uint8)
        truth = at.compose(TO_OPTICAL).inverse().compose(tag.place).translation
        found = finder.find(picture, CAMERA)
        false += sum(one.number != SEEN for one in found)
        errors += [
            math.dist(one.pose.translation, truth) / math.hypot(*truth)
            for one in found
            if one.number == SEEN and one.pose
        ]
    how = f"{VIEWS} drawn views of a tag of 15 cm, 0.5 to 3 m away and up to 60 deg from the side, with noise"
    yield Row("vision: views in which the tag is found", "%", how, 100 * len(errors) / VIEWS, least=99.0)
    yield Row("vision: error of its position", "%", f"{how}; median", 100 * float(np.median(errors)), most=1.0)
    yield Row("vision: tags that are not there", "", how, float(false), most=0.0)


def _through_the_bus() -> Row:
    """Return how old a picture is when another process learns of the pose of a tag in it."""
    with TemporaryDirectory() as folder:
        port = free_port()
        robot = Path(folder) / "robot.yaml"
        robot.write_text(ROBOT.format(port=port), encoding="utf-8")
        (Path(folder) / "world.yaml").write_text(WORLD, encoding="utf-8")
        ages: list[float] = []

        def take(message: Detection3DArray) -> None:
            if message.detections:
                ages.append(time.time() - to_nanoseconds(message.header.stamp) / 1e9)

        with up(str(robot), {"XDG_RUNTIME_DIR": folder}):
            end = Ours(port)
            end.bus.subscribe("bench", "/tags", Detection3DArray, Qos.STATE, take)
            end.until(lambda: bool(ages))
            ages.clear()
            for count in range(0, WATCHED + 1, WATCHED // 5):  # each within the patience of the end
                end.until(lambda count=count: len(ages) >= count)  # type: ignore[misc]
            end.bus.close()
    times = Samples(tuple(ages))
    how = "since a simulated camera of 640 x 480 took its picture, with drawing and finding, in 3 processes"
    return Row("vision: age of a pose of a tag", "ms", how, times.median * 1e3, times.p99 * 1e3, most=40.0)
