"""The planning scene: what may be in it, what moves with which link, and that arms keep clear of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3, quaternion_from_rpy
from rbxcompose.domains.arms.motion import scene as planning_scene
from rbxcompose.domains.arms.motion.collisions import MeshChecker, adjacent_pairs
from rbxcompose.domains.arms.motion.scene import MOST_SHAPES, PlacedObject, PlanningScene, SceneError, ScenePiece
from rbxcompose.domains.body.model import Geometry
from tests.loops import for_all
from tests.motion.scenes import FLOOR, MESH, OCTREE, objects, poses, solids
from tests.motion.toy_arm import kinematics, planner

ARM = kinematics()
BODY = ARM.body
SPACE = planner().space
BALL = PlacedObject("ball", Geometry("sphere", (0.05,)), "ground", Transform3((0.2, 0.4, 0.3)))
STL = """solid claw
facet normal 0 0 1
outer loop
vertex -0.1 -0.1 0
vertex 0.1 -0.1 0.001
vertex 0 0.1 0
endloop
endfacet
endsolid claw
"""
NOWHERE = Transform3((math.nan, 0.0, 0.0))


def frames(values: np.ndarray) -> Mapping[str, Transform3]:
    return ARM.poses(values)


def where(scene: PlanningScene, name: str, links: Mapping[str, Transform3]) -> Transform3:
    placed_object = scene.objects[name]
    return links[placed_object.link].compose(placed_object.pose)


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


@for_all(
    "one, named",
    [
        (PlacedObject("prism", Geometry("prism", (1.0,)), "ground", Transform3()), "'prism' is no shape"),
        (PlacedObject("box", Geometry("box", (1.0,)), "ground", Transform3()), "the size of a box is x, y, z"),
        (PlacedObject("box", Geometry("box", (1.0, 0.0, 1.0)), "ground", Transform3()), "0 m"),
        (PlacedObject("two", Geometry("sphere", (math.inf,)), "ground", Transform3()), "not finite"),
        (PlacedObject("two", BALL.shape, "ground", NOWHERE), "not finite"),
        (PlacedObject("two", BALL.shape, "ground", Transform3(rotation=(0.0,) * 4)), "no rotation"),
        (PlacedObject("two", BALL.shape, "grund", Transform3()), "there is no link 'grund'"),
        (PlacedObject("dust", Geometry("sphere", (1e-5,)), "ground", Transform3()), "at least 0.0001 m"),
        (PlacedObject("hill", Geometry("box", (1000.0, 1.0, 1.0)), "ground", Transform3()), "at most 100 m"),
        (PlacedObject("star", BALL.shape, "ground", Transform3((1e6, 0.0, 0.0))), "away from its frame"),
        (PlacedObject("soft", BALL.shape, "ground", Transform3(), padding=-0.1), "padding"),
        (PlacedObject("wall", Geometry("plane", (0.0, 0.0, 0.0, 1.0)), "ground", Transform3()), "its normal is not 1"),
        (PlacedObject("wall", FLOOR, "fore", Transform3()), "no link that moves can carry its plane"),
        (PlacedObject("hole", replace(MESH, triangles=(0, 1, 9)), "ground", Transform3()), "corner that there is not"),
        (PlacedObject("none", replace(MESH, points=()), "ground", Transform3()), "no points"),
        (PlacedObject("flat", replace(MESH, size=(1.0, 1.0, 0.0)), "ground", Transform3()), "scale of its mesh is 0"),
        (PlacedObject("ink", BALL.shape, "ground", Transform3(), colour=(2.0, 0.0, 0.0, 1.0)), "colour"),
        (PlacedObject("", BALL.shape, "ground", Transform3()), "name"),
        (PlacedObject("a\nb", BALL.shape, "ground", Transform3()), "name"),
        (PlacedObject("fore", BALL.shape, "ground", Transform3()), "is a link of the body"),
        (BALL, "already"),
    ],
)
def test_what_cannot_be_in_the_scene_says_why(one: PlacedObject, named: str) -> None:
    scene = PlanningScene(BODY, [BALL])
    with pytest.raises(SceneError, match=named):
        scene.add(one)


def test_there_is_an_end_to_the_number_of_objects(monkeypatch: pytest.MonkeyPatch) -> None:
    assert MOST_SHAPES == 1_000
    monkeypatch.setattr(planning_scene, "MOST_SHAPES", 30)
    scene = PlanningScene(BODY, (replace(BALL, name=f"ball {number}") for number in range(30)))
    scene.put(replace(BALL, name="ball 0"))
    with pytest.raises(SceneError, match="there would be 31 shapes, and may be 30"):
        scene.add(BALL)


def test_an_object_in_a_frame_outside_of_the_body_stays_there_while_the_body_moves() -> None:
    scene = PlanningScene(BODY, [replace(BALL, link="map")], ["map"])
    (placed_object,) = scene.on_body({"map": Transform3((1.0, 0.0, 0.0))})
    assert (placed_object.link, placed_object.pose.translation) == ("ground", (1.2, 0.4, 0.3))
    with pytest.raises(SceneError, match="no transform to 'map' is known, the frame of 'ball'"):
        scene.on_body({})
    scene.attach("ball", "fore", (), {**frames(np.zeros(3)), "map": Transform3()})
    assert scene.objects["ball"].link == "fore"


SLANTED = tuple(Transform3((0.3, 0.0, 0.0), quaternion_from_rpy(*turn)) for turn in ((0.3, -1.0, 0.0), (2.0, 0.5, 0.0)))
WALLS = tuple(ScenePiece(FLOOR, pose) for pose in SLANTED)
ROOM = PlacedObject("thing", FLOOR, "ground", Transform3((0.0, 0.0, -0.2)), pieces=WALLS)
"""A floor and two slanted walls, whose boxes have no end."""


@given(objects("thing"), st.integers(0, 2**31), st.floats(0.0, 0.1), st.floats(0.0, 0.1))
@example(ROOM, 0, 0.0, 0.0)
@example(PlacedObject("thing", FLOOR, "ground", Transform3()), 0, 0.0, 0.09)
def test_a_larger_padding_never_frees_anything(one: PlacedObject, seed: int, small: float, more: float) -> None:
    adjacent = adjacent_pairs(BODY)
    ways = [{"fore": small}, {"fore": small + more}]
    few, many = (MeshChecker(ARM, {}, adjacent, [replace(one, padding=small)], each) for each in ways)
    for values in SPACE.samples(20, seed):
        assert set(few.colliding(values)) <= set(many.colliding(values))
        assert many.is_free(values) == (not many.colliding(values))  # the tree of boxes overlooks nothing


@given(st.data(), st.integers(0, 2**31))
def test_what_collides_is_nearer_than_its_padding(data: st.DataObject, seed: int) -> None:
    one = replace(data.draw(objects("thing", solids)), padding=0.03)
    checker = MeshChecker(ARM, {}, adjacent_pairs(BODY), [one])
    for values in SPACE.samples(5, seed):
        for pair in checker.pairs(values):
            margin = 0.03 if "thing" in (pair.first, pair.second) else 0.0
            assert pair.collides == (pair.distance < margin) or abs(pair.distance - margin) < 2e-4


@given(poses, poses, solids, solids)
def test_a_distance_is_the_same_from_both_sides(one: Transform3, other: Transform3, a: Geometry, b: Geometry) -> None:
    values = np.array([0.8, 0.0, 0.2])
    held, there = PlacedObject("held", a, "tip", one), PlacedObject("there", b, "ground", other)
    turned = PlacedObject("held", b, "tip", frames(values)["tip"].inverse().compose(other))
    back = PlacedObject("there", a, "ground", frames(values)["tip"].compose(one))
    found = [
        next(each.distance for each in checker.pairs(values) if (each.first, each.second) == ("held", "there"))
        for checker in (MeshChecker(ARM, {}, (), [held, there]), MeshChecker(ARM, {}, (), [turned, back]))
    ]
    assert found[0] == pytest.approx(found[1], abs=1e-4) or max(found) < 0.0  # depths are estimates


def test_a_floor_is_solid_below_and_an_octree_where_its_cells_are() -> None:
    values = np.array([0.8, 0.0, 0.2])
    at = frames(values)["tip"]
    for shape in (FLOOR, OCTREE, MESH, Geometry("cone", (0.05, 0.1))):
        near = PlacedObject("thing", shape, "ground", Transform3(at.translation))
        far = PlacedObject("thing", shape, "ground", Transform3((0.0, 0.0, -3.0)))
        assert MeshChecker(ARM, {}, adjacent_pairs(BODY), [near]).colliding(values) == [("fore", "thing")]
        assert MeshChecker(ARM, {}, adjacent_pairs(BODY), [far]).is_free(values)


def test_meshes_of_the_body_and_simple_things_are_examined_together(tmp_path: Path) -> None:
    mesh = tmp_path / "claw.stl"
    mesh.write_text(STL)
    rock = PlacedObject("rock", Geometry("mesh", (1.0, 1.0, 1.0), str(mesh)), "tip", Transform3(), ("fore", "tip"))
    at = frames(np.zeros(3))["tip"].translation
    for shape in (FLOOR, OCTREE, MESH, BALL.shape, Geometry("box", (0.1, 0.1, 0.1))):
        near = PlacedObject("thing", shape, "ground", Transform3(at))
        assert ("rock", "thing") in MeshChecker(ARM, {}, adjacent_pairs(BODY), [rock, near]).colliding(np.zeros(3))


def test_distances_are_told_of_the_pairs_that_are_asked_for() -> None:
    others = [replace(BALL, name=f"ball {number}") for number in range(3)]
    checker = MeshChecker(ARM, {}, adjacent_pairs(BODY), others)
    values = np.array([0.8, 0.0, 0.2])
    assert {(pair.first, pair.second) for pair in checker.pairs(values, ("ball 1", "fore"))} == {("ball 1", "fore")}
    assert len(checker.pairs(values, ("fore",))) == 4  # the ground, too
    assert checker.pairs(values, ("ball 1", "ball 2")) == ()
    assert checker.watched == {"ball 0", "ball 1", "ball 2", "fore", "ground", "upper"}


def test_things_that_may_touch_each_other_do() -> None:
    values = np.array([0.8, 0.0, 0.2])
    cup = PlacedObject("cup", BALL.shape, "tip", Transform3(), ("fore", "tip"), ("table",))
    table = PlacedObject("table", Geometry("box", (0.3, 0.3, 0.02)), "ground", frames(values)["tip"], ("fore",))
    assert MeshChecker(ARM, {}, adjacent_pairs(BODY), [cup, table]).is_free(values)
    hit = MeshChecker(ARM, {}, adjacent_pairs(BODY), [replace(cup, touches_objects=()), table])
    assert hit.colliding(values) == [("cup", "table")]


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


def test_what_stood_in_the_map_stands_there_again_when_it_is_put_down_wherever_the_robot_has_driven() -> None:
    scene = PlanningScene(BODY, [replace(BALL, link="map")], ("map",))
    here = {**frames(np.zeros(3)), "map": Transform3((1.0, 0.0, 0.0))}
    there = {**frames(np.full(3, 0.3)), "map": Transform3((-1.0, 2.0, 0.0), quaternion_from_rpy(0.0, 0.0, 1.0))}
    scene.attach("ball", "tip", (), here)
    carried = where(scene, "ball", there).translation
    scene.detach("ball", there)
    assert scene.objects["ball"].link == "map"
    assert where(scene, "ball", there).translation == pytest.approx(carried)
    scene.attach("ball", "tip", (), there)
    scene.detach("ball", frames(np.full(3, 0.3)))  # nothing tells where the map is any more
    assert scene.objects["ball"].link == "ground"
