"""A number of any topic is judged by limits that YAML declares."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.base.levels import Level
from rbxcompose.msgs.geometry_msgs import Point, Pose, PoseStamped
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.testing.bench import Bench, instance
from tests.parts.project import Project


def test_limits_hysteresis_silence_and_live_settings() -> None:
    config = {"topic": "current", "warn_above": 2, "error_above": 3, "hysteresis": 0.5, "unit": "A", "timeout": "2 s"}
    bench = Bench(instance("motor", "threshold", config))
    found = bench.statuses("motor")
    told = []
    for number in (1.0, 2.5, 3.5, 2.8, 1.8, 1.0):
        bench.publish("current", Float32(data=number))
        bench.advance(1.0)
        told.append((found[-1].level, found[-1].message))
    ok, warn, error = Level.OK, Level.WARN, Level.ERROR
    assert told == [(ok, "1 A"), (warn, "2.5 A"), (error, "3.5 A"), (error, "2.8 A"), (warn, "1.8 A"), (ok, "1 A")]
    bench.set_live("motor", warn_above=0.5)
    bench.publish("current", Float32(data=1.0))
    assert found[-1].level == warn
    bench.advance(4.0)
    assert (found[-1].level, found[-1].message) == (Level.STALE, "nothing comes on 'current'")


def test_silence_from_the_start_is_told() -> None:
    bench = Bench(instance("motor", "threshold", {"topic": "current", "timeout": "1 s"}))
    found = bench.statuses("motor")
    bench.advance(3.0)
    assert found[-1].level == Level.STALE


def test_the_number_may_stand_deep_in_a_message() -> None:
    config = {"topic": "place", "message": "geometry_msgs/PoseStamped", "field": "pose.position.z", "error_below": 0}
    bench = Bench(instance("height", "threshold", config))
    found = bench.statuses("height")
    bench.publish("place", PoseStamped(pose=Pose(position=Point(z=-1.0))))
    bench.advance(1.0)
    assert (found[-1].level, found[-1].message) == (Level.ERROR, "-1")


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ("message: std_msgs/Flaot32", "did you mean 'std_msgs/msg/Float32'?"),
        ("message: geometry_msgs/Twist\n    field: linear.w", "geometry_msgs/msg/Vector3 has no field 'w'"),
        ("message: geometry_msgs/Twist\n    field: linear", "'linear' is a geometry_msgs/msg/Vector3, not a number"),
        ("warn_above: 3\n    error_above: 2", "'current' can never warn: it is already in error above 2"),
    ],
)
def test_mistakes_are_told_where_they_stand(written: str, said: str, tmp_path: Path) -> None:
    robot = f"components:\n  current:\n    type: threshold\n    topic: current\n    {written}\n"
    assert said in Project(tmp_path).check(robot).text
