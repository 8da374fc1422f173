"""The planning scene: what may be in it, what moves with which link, and that arms keep clear of it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.body.model import Geometry
from rbxcompose.geometry import Transform3, quaternion_from_rpy
from rbxcompose.motion.collisions import MeshChecker, adjacent_pairs
from rbxcompose.motion.scene import PlacedObject, PlanningScene, SceneError
from tests.motion.toy_arm import kinematics, planner

ARM = kinematics()
BODY = ARM.body
SPACE = planner().space
BALL = PlacedObject("ball", Geometry("sphere", (0.05,)), "ground", Transform3((0.2, 0.4, 0.3)))
NOWHERE = Transform3((math.nan, 0.0, 0.0))


def frames(values: np.ndarray) -> Mapping[str, Transform3]:
    return ARM.poses(values)


def where(scene: PlanningScene, name: str, links: Mapping[str, Transform3]) -> Transform3:
    one = scene.objects[name]
    return links[one.link].compose(one.pose)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from(["tip", "fore", "turret"]))
def test_an_object_stays_where_it_is_when_it_is_attached_and_moves_with_its_link(seed: int, link: str) -> None:
    here, there = SPACE.samples(2, seed)
    scene = PlanningScene(BODY, [BALL])
    scene.attach("ball", link, (), frames(here))
    assert where(scene, "ball", frames(here)).translation == pytest.approx((0.2, 0.4, 0.3))
    held = scene.objects["ball"].pose
    assert frames(there)[link].inverse().compose(where(scene, "ball", frames(there))).translation == pytest.approx(
        held.translation
    )
    after = where(scene, "ball", frames(there)).translation
    scene.detach("ball", frames(there))
    assert scene.objects["ball"].link == BODY.root
    assert where(scene, "ball", frames(here)).translation == pytest.approx(after)


def test_what_is_held_may_touch_the_hand_and_nothing_else() -> None:
    scene = PlanningScene(BODY, [BALL])
    scene.attach("ball", "fore", (), frames(np.zeros(3)))
    assert scene.objects["ball"].touches == ("fore", "tip")


def test_an_arm_collides_with_an_object_by_its_name_unless_it_may_touch_it() -> None:
    values = np.array([0.8, 0.0, 0.2])
    at_tip = frames(values)["tip"].translation
    post = PlacedObject("post", Geometry("cylinder", (0.03, 0.4)), "ground", Transform3(at_tip))
    adjacent = adjacent_pairs(BODY)
    assert MeshChecker(ARM, {}, adjacent).is_free(values)
    hit = MeshChecker(ARM, {}, adjacent, [post])
    assert not hit.is_free(values)
    assert hit.colliding(values) == [("fore", "post")]
    assert hit.is_free(np.array([-0.8, 0.0, 0.2]))
    held = PlacedObject("post", post.shape, "tip", Transform3(), ("fore", "tip"))
    assert MeshChecker(ARM, {}, adjacent, [held]).is_free(values)


def test_what_an_arm_holds_collides_with_the_things_around_it() -> None:
    values = np.array([0.8, 0.0, 0.2])
    x, y, z = frames(values)["tip"].translation
    table = PlacedObject("table", Geometry("box", (0.3, 0.3, 0.02)), "ground", Transform3((x, y, z - 0.2)))
    held = PlacedObject("rod", Geometry("box", (0.02, 0.02, 0.5)), "tip", Transform3(), ("fore", "tip"))
    assert MeshChecker(ARM, {}, adjacent_pairs(BODY), [table, held]).colliding(values) == [("rod", "table")]


@pytest.mark.parametrize(
    ("one", "named"),
    [
        (PlacedObject("cone", Geometry("cone", (1.0,)), "ground", Transform3()), "'cone' is no shape"),
        (PlacedObject("box", Geometry("box", (1.0,)), "ground", Transform3()), "the size of a box is x, y, z"),
        (PlacedObject("box", Geometry("box", (1.0, 0.0, 1.0)), "ground", Transform3()), "0 m"),
        (PlacedObject("two", Geometry("sphere", (math.inf,)), "ground", Transform3()), "inf m"),
        (PlacedObject("two", BALL.shape, "ground", NOWHERE), "not finite"),
        (PlacedObject("two", BALL.shape, "ground", Transform3(rotation=(0.0,) * 4)), "no rotation"),
        (PlacedObject("two", BALL.shape, "grund", Transform3()), "there is no link 'grund'"),
        (PlacedObject("fore", BALL.shape, "ground", Transform3()), "is a link of the body"),
        (BALL, "already"),
    ],
)
def test_what_cannot_be_in_the_scene_says_why(one: PlacedObject, named: str) -> None:
    scene = PlanningScene(BODY, [BALL])
    with pytest.raises(SceneError, match=named):
        scene.add(one)


def test_an_object_that_is_not_there_says_what_is() -> None:
    scene = PlanningScene(BODY, [BALL])
    with pytest.raises(SceneError, match="there: ball"):
        scene.remove("bal")
    with pytest.raises(SceneError, match="no link 'hand'"):
        scene.attach("ball", "hand", (), frames(np.zeros(3)))


def test_a_turned_box_is_turned() -> None:
    turn = quaternion_from_rpy(0.0, 0.0, math.pi / 2)
    values = np.array([0.8, 0.0, 0.2])
    x, y, z = frames(values)["tip"].translation
    plank = PlacedObject("plank", Geometry("box", (0.01, 0.6, 0.01)), "ground", Transform3((x + 0.2, y, z)))
    turned = PlacedObject("plank", plank.shape, "ground", Transform3((x + 0.2, y, z), turn))
    assert MeshChecker(ARM, {}, adjacent_pairs(BODY), [plank]).is_free(values)
    assert not MeshChecker(ARM, {}, adjacent_pairs(BODY), [turned]).is_free(values)
