"""Clouds of points as things that arms plan around: what they leave out, forget and refuse."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rbxcompose.base.geometry import Transform3
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.domains.arms.motion.octree_files import cells_of
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.arms.motion.scene_messages import object_message, placed_object
from rbxcompose.domains.body.model import Geometry
from rbxcompose.msgs.rbxcompose_msgs import MoveArm, SceneObjects
from rbxcompose.msgs.sensor_msgs import JointState, PointCloud2, PointField
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk.bound import Outcome
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance
from tests.components.slow_servos import with_slow_servos
from tests.conftest import ROOT
from tests.loops import for_all
from tests.motion.toy_arm import urdf

Array = NDArray[np.float64]
AT = {"turn": 1.5, "lift": 0.5, "bend": 0.5}
CELL = 0.02


def fields(kind: int = PointField.FLOAT32, *offsets: int) -> tuple[PointField, ...]:
    return tuple(
        PointField(name=name, offset=at, datatype=kind, count=1) for name, at in zip("xyz", offsets, strict=True)
    )


def cloud(points: Any, *, frame: str = "ground", kind: str = "<f4", rows: int = 1, padding: int = 0) -> PointCloud2:
    """Return points as a message: `rows` of them, with a colour between and bytes behind each row."""
    number = PointField.FLOAT64 if kind.endswith("f8") else PointField.FLOAT32
    size = np.dtype(kind).itemsize
    step = 4 * size + 4
    data = np.reshape(np.asarray(points, dtype=np.float64), (rows, -1, 3))
    row = data.shape[1] * step + padding
    raw = np.full((rows, row), 0xAB, dtype=np.uint8)
    for index, offset in enumerate((size, 0, 3 * size + 4)):  # y, x, z: the order is the fields' alone
        for one in range(rows):
            for column in range(data.shape[1]):
                at = column * step + offset
                value = np.array([data[one, column, (1, 0, 2)[index]]], dtype=kind)
                raw[one, at : at + size] = value.view(np.uint8)
    return PointCloud2(
        header=Header(frame_id=frame),
        height=rows,
        width=data.shape[1],
        fields=fields(number, 0, size, 3 * size + 4),
        is_bigendian=kind.startswith(">"),
        point_step=step,
        row_step=row,
        data=raw.tobytes(),
    )


def surface(x: float, y: float, z: float, half: float = 0.05) -> Array:
    """Return points all over a cube."""
    grid = np.linspace(-half, half, 11)
    points = np.array([(a, b, c) for a in grid for b in grid for c in grid])
    return np.asarray(points[np.max(np.abs(points), axis=1) > half - 1e-9] + (x, y, z))


class Mapper:
    """A mapper on a bench; `told` is what the scene hears."""

    def __init__(self, joints: bool = True, **config: object) -> None:
        settings = {"name": "camera", "topic": "points", "urdf": urdf(), "cell": CELL, **config}
        self.bench = Bench(instance("scene_camera", "cloud_mapper", settings))
        self.told = self.bench.collect("/scene/camera", SceneObjects, Qos.LATCHED)
        if joints:
            self.move(**AT)

    def move(self, **at: float) -> None:
        message = JointState(name=tuple(at), position=np.array([*at.values()]))
        self.bench.publish("/joint_states", message, Qos.STATE)
        self.bench.advance(0.05)

    def see(self, message: PointCloud2, age: float = 0.0) -> None:
        stamp = to_time(self.bench.clock.stamp() - round(age * 1e9))
        stamped = replace(message, header=replace(message.header, stamp=stamp))
        self.bench.publish("/points", stamped, Qos.BULK)
        self.bench.advance(1.0)

    @property
    def cells(self) -> Array:
        """Return the middles of cells in the root's frame."""
        (object_,) = self.told[-1].objects
        if not object_.shapes:
            return np.empty((0, 3))
        placed = placed_object(object_)
        return np.array(placed.shape.points).reshape(-1, 3) + placed.pose.translation

    @property
    def health(self) -> str:
        return str(self.bench.component("scene_camera").health(self.bench.clock.now()).message)  # type: ignore[attr-defined]


FAR = surface(0.6, 0.6, 0.6)


@pytest.mark.parametrize("kind", ["<f4", ">f4", "<f8", ">f8"])
@pytest.mark.parametrize(("rows", "padding"), [(1, 0), (2, 0), (2, 5)])
def test_all_layouts_have_the_same_cells(kind: str, rows: int, padding: int) -> None:
    mapper = Mapper()
    mapper.see(cloud(FAR[:600], kind=kind, rows=rows, padding=padding))
    expected = cells_of(FAR[:600].astype(kind).astype(np.float64), CELL)
    assert np.unique(np.round(mapper.cells, 6), axis=0) == pytest.approx(np.round(expected, 6))


def test_points_that_are_none_or_far_away_or_of_the_robot_or_of_known_things_are_left_out() -> None:
    mapper = Mapper(range=1.5)
    body = mapper.bench.component("scene_camera").body  # type: ignore[attr-defined]
    poses = body.poses(AT)
    arm = [poses[link].apply((x, 0.0, 0.03)) for link in ("upper", "fore") for x in (0.1, 0.16, 0.22, 0.28)]
    nothing = [(math.nan, 0.0, 1.0), (math.inf, 0.0, 0.0), (3.0, 0.0, 0.0)]
    mapper.see(cloud([*arm, *nothing]))
    assert mapper.told == []  # nothing has changed
    assert mapper.health.startswith("8 points, 0 cells")
    box = PlacedObject("box", Geometry("box", (0.12, 0.12, 0.12)), "ground", Transform3((0.6, 0.6, 0.6)))
    mapper.bench.publish("/scene", SceneObjects(objects=(object_message(box),)), Qos.LATCHED)
    mapper.bench.advance(0.1)
    mapper.see(cloud([*FAR, (0.9, 0.6, 0.6)]))
    assert len(mapper.cells) == 1


def test_a_cloud_in_the_frame_of_a_link_is_where_that_was_at_its_time() -> None:
    mapper = Mapper(joints=False)
    mapper.move(turn=math.pi / 2, lift=0.0, bend=0.0)
    mapper.bench.advance(0.5)
    mapper.move(turn=-math.pi / 2)
    mapper.see(cloud([(1.0, 0.0, 0.0)], frame="turret"), age=0.4)
    assert mapper.cells[0] == pytest.approx((0.0, 1.0, 0.3), abs=CELL)


def test_cells_are_forgotten_by_the_time_of_clouds_and_stay_while_none_comes() -> None:
    mapper = Mapper(forget=2.5)
    mapper.see(cloud(FAR))
    count = len(mapper.cells)
    mapper.bench.advance(20.0)
    assert len(mapper.told) == 1
    assert "no cloud for 21 s: what was seen last stays" in mapper.health
    mapper.see(cloud([(0.8, 0.8, 0.8)]))
    assert len(mapper.cells) == 1
    for _ in range(3):
        mapper.see(cloud(FAR))
    assert len(mapper.cells) == count
    mapper.see(cloud([]))
    mapper.see(cloud([]))
    mapper.see(cloud([]))
    assert len(mapper.cells) == 0


def test_no_more_clouds_are_used_than_were_asked_for_and_the_same_cells_are_told_once() -> None:
    mapper = Mapper(rate=0.5)
    for _ in range(6):
        mapper.see(cloud(FAR))
    assert len(mapper.told) == 1
    mapper.see(cloud(FAR[:50]))
    assert len(mapper.told) <= 2


WRONG = cloud(FAR)


@for_all(
    "message, age, told",
    [
        (replace(WRONG, fields=WRONG.fields[:2]), 0.0, "it has no field 'z'; its fields: x, y"),
        (replace(WRONG, fields=(*WRONG.fields[:2], replace(WRONG.fields[2], offset=99))), 0.0, "beyond the 20 bytes"),
        (replace(WRONG, fields=(*WRONG.fields[:2], replace(WRONG.fields[2], datatype=9))), 0.0, "no single number"),
        (replace(WRONG, data=WRONG.data[:-1]), 0.0, "bytes, and needs"),
        (replace(WRONG, height=2, row_step=3), 0.0, "a row has 3 bytes"),
        (replace(WRONG, width=4_000_000_000), 0.0, "points, and may have"),
        (replace(WRONG, point_step=0), 0.0, "beyond the 0 bytes"),
        (cloud(FAR, frame="moon"), 0.0, "'moon' is no link of the body"),
        (WRONG, 3.0, "its stamp is 3.0 s old"),
        (WRONG, -3.0, "its stamp is 3.0 s in the future"),
    ],
)
def test_a_cloud_that_is_none_is_told_and_the_next_one_is_used(message: PointCloud2, age: float, told: str) -> None:
    mapper = Mapper()
    mapper.see(message, age)
    assert told in mapper.health
    assert told in mapper.bench.texts()[-1]
    assert mapper.told == []
    mapper.see(WRONG)
    assert mapper.told
    assert told not in mapper.health


def test_nothing_is_seen_before_the_robot_knows_where_it_is() -> None:
    mapper = Mapper(joints=False)
    mapper.see(WRONG)
    assert "nothing has reported where joints are" in mapper.health


PAN, LIFT = "right_arm_shoulder_pan_joint", "right_arm_shoulder_lift_joint"


@pytest.mark.timeout(180)
def test_an_arm_goes_around_what_a_camera_sees(tmp_path: Path) -> None:
    overlay = tmp_path / "camera.yaml"
    overlay.write_text(
        "rbx: 1\nkind: Overlay\nname: camera\nscene: {clouds: {camera: {topic: points, forget: 60 s}}}\n"
    )
    compiled = compile_robot(str(ROOT / "robots/pi_robot"), overlays=[str(overlay)], environment={})
    assert compiled.plan, compiled.report
    wanted = ("arm", "servo_bus", "scene", "cloud_mapper")
    bench = Bench(*(one for one in with_slow_servos(compiled.plan.instances) if one.type in wanted))
    states = bench.collect("/joint_states", JointState, Qos.STATE)
    scenes = bench.collect("/scene", SceneObjects, Qos.LATCHED)
    bench.advance(1.0)

    def moved(**positions: float) -> Any:
        ends: list[Any] = []
        goal = MoveArm.Goal(joints=tuple(positions), positions=np.array([*positions.values()]), replan=0)
        bench.bus.action_client("me", "/right_arm/move", MoveArm)(goal, ends.append)
        assert bench.run_until(lambda: bool(ends), 60.0)
        return ends[0]

    works = bench.component("right_arm").works  # type: ignore[attr-defined]
    straight = {LIFT: -math.pi / 2}
    between = works.kinematics.body.poses({PAN: 0.0, **straight})["right_arm_tip"].translation
    assert moved(**{PAN: -0.6, **straight}).outcome is Outcome.SUCCEEDED
    bench.publish("/points", replace(cloud(surface(*between), frame=""), header=Header()), Qos.BULK)
    bench.advance(1.0)
    assert [object_.name for object_ in scenes[-1].objects] == ["camera"]
    before = len(states)
    end = moved(**{PAN: 0.6})
    assert end.outcome is Outcome.SUCCEEDED, end.result
    box = PlacedObject("box", Geometry("box", (0.1, 0.1, 0.1)), works.kinematics.body.root, Transform3(between))
    checker = works.checker([box])
    places = [dict(zip(state.name, state.position.tolist(), strict=True)) for state in states[before:]]
    assert all(checker.is_free(np.array([at[name] for name in works.space.names])) for at in places)
    assert max(abs(at[LIFT] + math.pi / 2) for at in places) > 0.1  # not the straight way
    x, y, z = works.kinematics.body.poses(places[-1])["right_arm_tip"].translation
    arm = surface(x, y, z, half=0.01)
    bench.publish("/points", replace(cloud(arm, frame=""), header=Header()), Qos.BULK)
    bench.advance(1.0)
    assert moved(**{LIFT: -1.3}).outcome is Outcome.SUCCEEDED  # it does not see itself
