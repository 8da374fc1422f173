"""Where a robot is, by tags of known places: the filter, and a robot that was put down anywhere and finds its dock."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2, wrap_angle
from rbxcompose.base.levels import Level
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.domains.navigation.components.tag_localisation import SURE, PlacedTag, TagFilter
from rbxcompose.domains.navigation.localiser import RESTARTED
from rbxcompose.msgs.geometry_msgs import PoseWithCovariance, PoseWithCovarianceStamped, Twist, Vector3
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.poses import message_of, pose_in
from rbxcompose.msgs.std_msgs import Header, String
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk.component import MissionOver
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance
from tests.conftest import ROOT

TAGS = {"west": Pose2(0.0, 2.0, 0.0), "north": Pose2(3.0, 5.0, -math.pi / 2), "east": Pose2(6.0, 1.0, math.pi)}
POSES = st.builds(Pose2, st.floats(1, 5), st.floats(0.5, 4), st.floats(-3.1, 3.1))
NOISE = (0.01, 0.01, 0.02)  # [m], [m], [rad]


def seen(name: str, pose: Pose2, random: np.random.Generator | None = None, *, is_square: bool = True) -> PlacedTag:
    """Return a tag as it is seen from a pose in the map, with noise."""
    at = pose.inverse().compose(TAGS[name])
    dx, dy, turn = random.normal(0.0, NOISE) if random is not None else (0.0, 0.0, 0.0)
    mirrored = 0.0 if is_square else 0.5
    measured = Pose2(at.x + dx, at.y + dy, wrap_angle(at.heading + turn + mirrored))
    return PlacedTag(name, measured, np.diag(np.square(NOISE)), is_square)


def off(found: Pose2 | None, truth: Pose2) -> tuple[float, float]:
    assert found is not None
    return found.distance(truth), abs(wrap_angle(found.heading - truth.heading))


@given(POSES, st.sampled_from(sorted(TAGS)))
def test_one_tag_is_enough_to_know_where_a_robot_is(pose: Pose2, name: str) -> None:
    known = TagFilter(TAGS)
    known.move(Pose2(0.3, -0.2, 1.0))
    assert known.see(seen(name, pose))
    assert off(known.pose, pose) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert off(known.correction, pose.compose(Pose2(0.3, -0.2, 1.0).inverse())) == pytest.approx((0.0, 0.0), abs=1e-9)


@settings(max_examples=20)
@given(POSES, st.integers(0, 1000), st.floats(-0.03, 0.03))
def test_on_a_drive_it_stays_known_although_odometry_errs(start: Pose2, seed: int, drift: float) -> None:
    random, known, pose, odometry = np.random.default_rng(seed), TagFilter(TAGS), start, Pose2()
    known.start(start, 0.2, 0.2)
    for cycle in range(120):
        step = Pose2(0.02, 0.0, 0.03)
        pose = pose.compose(step)
        odometry = odometry.compose(Pose2(0.02 * (1 + drift), 0.0, 0.03 * (1 + drift)))
        known.move(odometry)
        if cycle % 5 == 0:
            known.see(seen(sorted(TAGS)[cycle // 5 % 3], pose, random, is_square=cycle % 10 == 0))
    away, turned = off(known.pose, pose)
    assert away < 0.05
    assert turned < 0.03


def test_errors_are_as_large_as_the_covariance_says() -> None:
    scores = []
    for seed in range(60):
        random, known, pose = np.random.default_rng(seed), TagFilter(TAGS), Pose2(2.0, 2.0, 0.7)
        known.move(Pose2())
        for name in TAGS:
            known.see(seen(name, pose, random))
        assert known.pose is not None
        error = np.array((known.pose.x - 2.0, known.pose.y - 2.0, wrap_angle(known.pose.heading - 0.7)))
        scores.append(error @ np.linalg.solve(known.covariance, error))
    assert 0.5 < np.mean(scores) < 4.5  # of a sum of three squares, which is 3 on average


def test_without_a_tag_it_becomes_less_and_less_sure() -> None:
    known = TagFilter(TAGS)
    known.start(Pose2(), 0.01, 0.01)
    errors = []
    for cycle in range(40):
        known.move(Pose2(0.1 * cycle, 0.0, 0.0))
        errors.append(known.error)
    assert errors == sorted(errors)
    assert errors[-1] > 0.05


def test_a_tag_that_is_elsewhere_counts_not_and_a_robot_that_was_carried_knows_it_soon() -> None:
    known, pose = TagFilter(TAGS), Pose2(2.0, 2.0, 0.0)
    known.start(pose, 0.02, 0.02)
    known.move(Pose2())
    assert not known.see(seen("west", Pose2(4.0, 3.0, 1.0)))
    assert off(known.pose, pose)[0] < 0.01
    assert known.rejected == 1
    assert known.see(seen("west", pose))
    assert known.rejected == 0
    elsewhere = Pose2(4.0, 3.0, 1.0)
    for _ in range(SURE):
        known.see(seen("north", elsewhere))
    assert off(known.pose, elsewhere)[0] < 0.01


def test_a_tag_of_which_it_is_not_known_how_it_is_turned_does_not_begin() -> None:
    known = TagFilter(TAGS)
    known.move(Pose2())
    assert not known.see(seen("west", Pose2(2.0, 2.0, 0.0), is_square=False))
    assert known.pose is None
    assert not known.see(PlacedTag("unknown", Pose2(1.0), np.eye(3)))


SPAWNS = [(room, "ideal") for room in ("bathroom", "kitchen", "sofa", "hallway")]


@pytest.mark.parametrize(("spawn", "simulator"), [*SPAWNS, ("bathroom", "physics")])
@pytest.mark.soak
def test_a_robot_that_was_put_down_anywhere_finds_its_dock(spawn: str, simulator: str) -> None:
    pytest.importorskip("cv2", reason="OpenCV is not installed")
    if simulator == "physics":
        pytest.importorskip("mujoco", reason="mujoco is not installed")
    sets = (f"simulator={simulator}", f"world.spawn={spawn}")
    plan = compile_robot(str(ROOT / "robots/house"), profiles=["lost"], sets=sets, environment={}).plan
    assert plan is not None
    bench = Bench(plan=plan)
    truth, contacts = bench.collect("/ground_truth", Odometry), bench.collect("/contact", String)
    pictures = bench.statuses("physics: pictures")
    assert bench.run_until(lambda: any(isinstance(event, MissionOver) for event in bench.events), 90.0)
    if pictures and pictures[-1].level == Level.ERROR:
        pytest.skip(pictures[-1].message)
    assert [event.outcome for event in bench.events if isinstance(event, MissionOver)] == ["success"]
    at = pose_in(truth[-1].pose.pose)
    assert math.dist((at.x, at.y), (1.0, 0.61)) < 0.03
    assert abs(wrap_angle(at.heading + math.pi / 2)) < math.radians(3)
    assert not contacts


def test_a_pose_that_somebody_points_at_counts_unless_it_is_no_pose() -> None:
    bench = Bench(
        instance("base", "diff_drive_sim", {}),
        instance("localisation", "tag_localisation", {"tags": {"west": (0.0, 2.0, 0.0)}, "anywhere": True}),
    )
    placed = bench.collect("/tf", TFMessage)
    statuses = bench.statuses("localisation")

    def odom_in_map() -> list[float]:
        found = [one for message in placed for one in message.transforms if one.header.frame_id == "map"]
        return [found[-1].transform.translation.x] if found else []

    def point(x: float) -> None:
        pose = PoseWithCovariance(message_of(Pose2(x, 1.0, 0.5)), np.zeros(36))
        bench.publish("/initialpose", PoseWithCovarianceStamped(Header(frame_id="map"), pose), Qos.EVENT)
        bench.advance(1.5)

    bench.advance(2.5)
    assert odom_in_map() == []
    assert statuses[-1].message == "the camera has told nothing yet"
    point(math.nan)
    assert odom_in_map() == []
    point(2.0)
    assert odom_in_map() == pytest.approx([2.0])


def test_over_a_restart_the_place_stays_known_unless_odometry_begins_again() -> None:
    bench = Bench(
        instance("base", "diff_drive_sim", {}),
        instance("localisation", "tag_localisation", {"tags": {"west": (0.0, 2.0, 0.0)}, "start": (2.0, 1.0, 0.5)}),
    )
    for _ in range(20):
        bench.publish("/cmd_vel", Twist(linear=Vector3(x=0.4)))
        bench.advance(0.25)
    placed, statuses = bench.collect("/tf", TFMessage), bench.statuses("localisation")

    def odom_in_map() -> list[float]:
        found = [one for message in placed for one in message.transforms if one.header.frame_id == "map"]
        return [one.transform.translation.x for one in found]

    bench.host.failed("localisation", ValueError("planted"))
    bench.advance(2.5)
    assert set(np.round(odom_in_map(), 2)) == {2.0}
    for name, doubt in ("base", "the odometry of the base has begun again"), ("localisation", RESTARTED):
        bench.host.failed(name, ValueError("planted"))
        bench.advance(0.5)
        placed.clear()
        bench.advance(2.0)
        assert odom_in_map() == []
        assert statuses[-1].message == f"{doubt}: the camera has told nothing yet"
