"""A head with simulated servos looks at objects, links and points, follows a point, and tells why it cannot."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from rbxcompose.compiler.plan.model import Instance
from rbxcompose.domains.arms.motion.gaze import past
from rbxcompose.msgs.geometry_msgs import Point, PointStamped
from rbxcompose.msgs.rbxcompose_msgs import LookAtPoint
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk.bound import Outcome
from rbxcompose.testing import Bench
from tests.shipped import robot_and_plan

TYPES = ("head", "servo_bus", "scene", "transforms")


@pytest.fixture(scope="module")
def parts() -> dict[str, Instance]:
    _, plan = robot_and_plan("pi_robot", "table")
    return {instance.type: instance for instance in plan.instances if instance.type in TYPES}


def robot(parts: dict[str, Instance], **changes: object) -> Bench:
    """Return a head whose configuration is changed; without a type that is changed to None."""
    kept = {name: instance for name, instance in parts.items() if changes.get(name, instance) is not None}
    config = parts["head"].config.model_copy(update={name: to for name, to in changes.items() if name not in TYPES})
    bench = Bench(*(kept | {"head": replace(parts["head"], config=config)}).values())
    bench.advance(0.5)
    return bench


def looked(bench: Bench, goal: LookAtPoint.Goal) -> tuple[Outcome, LookAtPoint.Result | None]:
    ends: list[Any] = []
    bench.bus.action_client("me", "/head/look_at", LookAtPoint)(goal, ends.append)
    for _ in range(100):
        bench.advance(0.1)
        if ends:
            return ends[0].outcome, ends[0].result
    raise AssertionError("it does not end")


def angle_to(bench: Bench, point: tuple[float, float, float]) -> float:
    """Return by how much the camera looks past a point of the root's frame now [rad]."""
    head: Any = bench.component("head")
    return past(head.body.poses(head.positions)["camera_depth_frame"].inverse().apply(point))


def test_it_ends_when_the_camera_looks_at_an_object(parts: dict[str, Instance]) -> None:
    bench = robot(parts)
    outcome, result = looked(bench, LookAtPoint.Goal(object="box1"))
    assert outcome is Outcome.SUCCEEDED
    assert result is not None
    assert result.angle < math.radians(1)
    bench.advance(0.5)
    assert angle_to(bench, (0.27, -0.12, 0.78)) < math.radians(1)


@pytest.mark.parametrize(
    ("goal", "changes", "reason", "said"),
    [
        (
            LookAtPoint.Goal(object="cup"),
            {},
            "unknown_object",
            "there is no object 'cup' in the scene; there: box1, box2",
        ),
        (LookAtPoint.Goal(x=1.0, frame="nowhere"), {}, "unknown_goal", "there is no link 'nowhere'"),
        (LookAtPoint.Goal(x=1.0, frame="map"), {}, "unknown_goal", "there is no link 'map'"),
        (LookAtPoint.Goal(x=1.0, frame="map"), {"frames": ("map",)}, "unknown_scene", "map"),
        (LookAtPoint.Goal(x=-5.0, z=0.8), {}, "goal_out_of_reach", "deg past it, more than 1.0 deg: 'head_pan_joint'"),
        (LookAtPoint.Goal(frame="camera_depth_frame"), {}, "goal_out_of_reach", "the point is within the camera"),
        (LookAtPoint.Goal(object="box1"), {"scene": None}, "unknown_scene", "no planning scene has been received"),
        (LookAtPoint.Goal(object="box1"), {"sees_scene": False}, "unknown_scene", "this robot has no scene"),
        (
            LookAtPoint.Goal(x=1.0),
            {"servo_bus": None},
            "unknown_start",
            "nothing has reported where 'head_pan_joint' is",
        ),
        (LookAtPoint.Goal(x=1.0, z=0.9, duration=1e-3), {}, "not_followed", "head_"),
    ],
)
def test_a_failure_names_its_reason(
    parts: dict[str, Instance], goal: LookAtPoint.Goal, changes: dict[str, object], reason: str, said: str
) -> None:
    outcome, result = looked(robot(parts, **changes), goal)
    assert outcome is Outcome.ABORTED
    assert result is not None
    assert result.outcome == reason
    assert said in result.message


def test_numbers_that_are_none_are_refused(parts: dict[str, Instance]) -> None:
    bench = robot(parts)
    for goal in (LookAtPoint.Goal(x=math.nan), LookAtPoint.Goal(tolerance=-1.0)):
        assert looked(bench, goal)[0] is Outcome.REJECTED


def test_a_tolerance_lets_it_look_past_what_it_cannot_turn_to(parts: dict[str, Instance]) -> None:
    outcome, result = looked(robot(parts), LookAtPoint.Goal(x=-5.0, z=0.8, tolerance=math.radians(60)))
    assert outcome is Outcome.SUCCEEDED
    assert result is not None
    assert math.radians(10) < result.angle < math.radians(60)


def test_a_newer_goal_replaces_an_older_one_and_a_cancelled_one_lets_the_head_rest(parts: dict[str, Instance]) -> None:
    bench = robot(parts)
    ends: list[Any] = []
    client = bench.bus.action_client("me", "/head/look_at", LookAtPoint)
    client(LookAtPoint.Goal(x=-1.0, y=2.0, z=0.8), ends.append)
    bench.advance(0.4)
    second = client(LookAtPoint.Goal(x=-1.0, y=-2.0, z=0.8), ends.append)
    bench.advance(0.4)
    second.cancel()
    bench.advance(1.0)
    assert [end.outcome for end in ends] == [Outcome.ABORTED, Outcome.CANCELED]
    head: Any = bench.component("head")
    at = dict(head.positions)
    bench.advance(1.0)
    assert head.positions == pytest.approx(at, abs=2e-3)
    assert looked(bench, LookAtPoint.Goal(x=1.0, z=0.8))[0] is Outcome.SUCCEEDED


def test_a_point_that_moves_is_followed(parts: dict[str, Instance]) -> None:
    bench = robot(parts)
    off = []
    for step in range(120):
        point = (1.0, math.sin(step / 40), 1.0)
        message = PointStamped(header=Header(), point=Point(x=point[0], y=point[1], z=point[2]))
        bench.publish("/head/target", message)
        bench.advance(0.05)
        off.append(angle_to(bench, point))
    assert max(off[40:]) < math.radians(8)
    bench.publish("/head/target", PointStamped(header=Header(frame_id="nowhere")))
    assert any("a target is not followed: there is no link 'nowhere'" in text for text in bench.texts())
