"""Picking and placing on a table: what ends where, and that each failure names its stage and its reason."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import pytest

from rbxcompose.base.geometry import Transform3, quaternion_from_rpy
from rbxcompose.domains.arms.arm_config import ArmWorks
from rbxcompose.domains.arms.motion import hand_task as contacts
from rbxcompose.domains.arms.motion.collisions import MeshChecker
from rbxcompose.domains.arms.motion.hand_task import HandTask, LineEnd, line_steps
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.arms.section_models import GraspModel
from rbxcompose.domains.body.model import Geometry
from rbxcompose.msgs.rbxcompose_msgs import MoveArm, PickObject, PlaceObject
from tests.loops import for_all
from tests.motion.pi_hand import FINGER, HandBench
from tests.soak import rare

PICK, PLACE = PickObject.Goal(object="target"), PlaceObject.Goal(spot="table_right")
ROOT = "base_footprint"
SPOT = (0.24, -0.20, 0.765)
LEANING = quaternion_from_rpy(0.5, 0.5, 0.0)


def box(name: str, size: tuple[float, float, float], at: tuple[float, float, float]) -> PlacedObject:
    return PlacedObject(name, Geometry("box", size), ROOT, Transform3(at))


@cache
def picked() -> HandBench:
    bench = HandBench()
    assert bench.carried_out(PICK).failure is None
    return bench


def holding(*further: PlacedObject) -> HandBench:
    """Return an arm that holds the target, among further things."""
    bench, before = HandBench(*further, without=("target",)), picked()
    bench.measured, bench.picked = dict(before.measured), dict(before.picked)
    bench.scene.add(before.scene.objects["target"])
    bench.works.place_objects(bench.objects)
    return bench


def failed(bench: HandBench, goal: PickObject.Goal | PlaceObject.Goal) -> tuple[str, str, str]:
    failure = bench.carried_out(goal).failure
    assert failure is not None
    assert isinstance(bench.task, HandTask)
    return bench.task.stage if not hasattr(failure, "stage") else failure.stage, failure.reason, failure.text


def test_an_object_is_taken_from_between_boxes_and_put_down_elsewhere() -> None:
    assert picked().openings == pytest.approx([0.05, 0.02])
    bench = holding()
    held = bench.scene.objects["target"]
    assert held.link == "right_arm_tip"
    assert bench.place_of("target")[2] == pytest.approx(0.765 + 0.08, abs=2e-3)
    assert bench.carried_out(PLACE).failure is None
    assert bench.scene.objects["target"].link == ROOT
    assert math.dist(bench.place_of("target"), SPOT) < 0.02 + 3e-3  # the tolerance of the spot
    assert bench.carried_out(MoveArm.Goal(pose="resting")).failure is None


def test_it_stands_upright_again_wherever_the_arm_was_meanwhile() -> None:
    bench = holding()
    assert bench.carried_out(MoveArm.Goal(pose="wave")).failure is None
    assert bench.carried_out(PlaceObject.Goal(x=0.24, y=0.0, z=0.766)).failure is None
    assert bench.place_of("target") == pytest.approx((0.24, 0.0, 0.766), abs=2e-3)
    turn = bench.scene.objects["target"].pose.rotation
    assert math.hypot(turn[0], turn[1]) < 0.01


@pytest.mark.parametrize("shape", [Geometry("cylinder", (0.02, 0.12)), *rare(Geometry("sphere", (0.03,)))])
def test_round_things_are_grasped_from_their_shape(shape: Geometry) -> None:
    height = 0.705 + (0.06 if shape.kind == "cylinder" else 0.03)
    placed_object = PlacedObject("target", shape, ROOT, Transform3((0.24, 0.0, height)))
    bench = HandBench(placed_object, without=("target",))
    assert bench.carried_out(PICK).failure is None


@pytest.mark.parametrize(
    ("further", "stage", "reason", "told"),
    [
        pytest.param((box("roof", (0.1, 0.1, 0.02), (0.24, 0, 0.85)),), "lift", "path_in_collision",
                     "'roof' and 'target'", marks=pytest.mark.soak),
        ((box("wall", (0.02, 0.6, 0.3), (0.19, 0, 0.86)),), "grasp", "goal_in_collision", "'wall'"),
        ((box("crate", (0.1, 0.1, 0.1), (-0.1, -0.08, 0.55)),), "approach", "start_in_collision", "'crate'"),
        pytest.param((box("lid", (0.06, 0.06, 0.01), (0.24, 0, 0.83)),
                      box("left", (0.06, 0.01, 0.12), (0.24, 0.034, 0.765)),
                      box("right", (0.06, 0.01, 0.12), (0.24, -0.034, 0.765))),
                     "grasp", "goal_in_collision", "'left'", marks=pytest.mark.soak),
    ],
)  # fmt: skip
def test_a_blocked_table_tells_the_stage_and_the_reason(
    further: tuple[PlacedObject, ...], stage: str, reason: str, told: str
) -> None:
    found = failed(HandBench(*further), PICK)
    assert found[:2] == (stage, reason)
    assert told in found[2]


@pytest.mark.parametrize(
    ("size", "at", "stage", "reason"),
    [
        ((0.02, 0.02, 0.12), (0.9, 0.0, 0.765), "grasp", "goal_out_of_reach"),
        ((0.15, 0.15, 0.08), (0.24, 0.0, 0.745), "choose", "too_wide"),
    ],
)
def test_an_object_that_cannot_be_grasped_says_why(
    size: tuple[float, float, float], at: tuple[float, float, float], stage: str, reason: str
) -> None:
    bench = HandBench(box("other", size, at), without=("target", "box1", "box2"))
    found = failed(bench, PickObject.Goal(object="other"))
    assert found[:2] == (stage, reason)
    assert (
        reason != "too_wide"
        or found[2] == "'other' is 15.0 cm wide where fingers hold it, and the gripper opens 11.0 cm"
    )


def test_the_scene_is_modelled_once_for_all_grasps(monkeypatch: pytest.MonkeyPatch) -> None:
    bench, built = HandBench(box("wall", (0.02, 0.6, 0.3), (0.19, 0, 0.86))), list[object]()
    build = MeshChecker.__init__
    monkeypatch.setattr(MeshChecker, "__init__", lambda one, *given, **named: built.append(build(one, *given, **named)))
    assert "the nearest of 98 poses" in failed(bench, PICK)[2]
    assert len(built) == 1  # to see what the target stands on


def test_a_blocked_table_is_told_after_few_steps_of_the_component(monkeypatch: pytest.MonkeyPatch) -> None:
    bench, steps, advance = HandBench(box("wall", (0.02, 0.6, 0.3), (0.19, 0, 0.86))), list[None](), HandTask.advance
    monkeypatch.setattr(HandTask, "advance", lambda task: steps.append(advance(task)))
    assert "the nearest of 98 poses" in failed(bench, PICK)[2]
    assert len(steps) < 10  # 20 are a second


@pytest.mark.soak  # how long it takes; a blocked table is told soon, too
def test_lines_are_not_followed_behind_what_they_hit(monkeypatch: pytest.MonkeyPatch) -> None:
    followed, whole = list[object](), list[object]()

    def counted(*given: Any) -> Any:
        whole.extend(line_steps(*given))
        for step in line_steps(*given):
            followed.append(step)
            yield step
        return LineEnd(0.0, "it is out of reach")

    monkeypatch.setattr(contacts, "line_steps", counted)
    assert failed(HandBench(box("roof", (0.1, 0.1, 0.02), (0.24, 0, 0.85))), PICK)[0] == "lift"
    assert len(followed) < 0.8 * len(whole)


def test_an_unknown_object_names_those_that_are_there() -> None:
    stage, reason, text = failed(HandBench(), PickObject.Goal(object="cup"))
    assert (stage, reason) == ("choose", "unknown_object")
    assert "there: box1, box2, table, target" in text


def test_a_hand_that_holds_something_does_not_pick_and_an_empty_one_does_not_place() -> None:
    assert failed(HandBench(), PLACE)[:2] == ("choose", "nothing_held")
    assert failed(holding(), PickObject.Goal(object="box1"))[:2] == ("choose", "already_holds")


def test_picking_may_be_asked_for_again() -> None:
    bench = holding()
    assert bench.carried_out(PICK).failure is None
    assert bench.scene.objects["target"].link == "right_arm_tip"


@pytest.mark.parametrize(
    ("what", "stage", "reason", "is_held"),
    [
        ("grip", "open", "gripper_failed", False),
        ("follow", "approach", "not_followed", False),
        ("attach", "attach", "not_attached", False),
    ],
)
def test_what_fails_on_the_way_is_told_with_its_stage(what: str, stage: str, reason: str, is_held: bool) -> None:
    bench = HandBench()
    bench.problems[what] = "for a reason"
    assert failed(bench, PICK) == (stage, reason, "for a reason")
    assert (bench.scene.objects["target"].link == "right_arm_tip") is is_held


def test_a_gripper_that_does_not_open_is_told() -> None:
    bench = HandBench()
    bench.slips = 0.03
    assert failed(bench, PICK) == ("open", "gripper_failed", "it opened to 20 of 50 mm")


def test_what_lies_flat_is_picked_from_above_and_put_down_again() -> None:
    shelf = box("shelf", (0.3, 0.6, 0.01), (0.2, -0.1, 0.55))
    plate = box("target", (0.05, 0.03, 0.02), (0.12, -0.1, 0.565))
    bench = HandBench(shelf, plate, without=("table", "target", "box1", "box2"))
    assert bench.carried_out(PICK).failure is None
    assert bench.carried_out(PlaceObject.Goal(on="shelf", x=-0.08, y=0.08, tolerance=0.02)).failure is None
    assert bench.place_of("target")[2] == pytest.approx(0.566, abs=2e-3)


def test_a_gripper_that_closes_farther_than_the_object_is_wide_has_missed_it() -> None:
    bench = HandBench()
    assert failed(bench, PickObject.Goal(object="target", squeeze=0.01))[:2] == ("close", "nothing_grasped")
    assert bench.openings[-1] == pytest.approx(0.05)  # open again, so that the arm can leave
    assert bench.scene.objects["target"].link == ROOT


@pytest.mark.parametrize("stage", ["lift", *rare("approach", "open", "grasp", "close")])
def test_picking_can_be_cancelled_in_each_stage(stage: str) -> None:
    bench = HandBench()
    bench.during = lambda now: bench.task.cancel() if now == stage else None
    assert failed(bench, PICK)[:2] == (stage, "interrupted")
    is_held = bench.scene.objects["target"].link == "right_arm_tip"
    assert is_held is (stage == "lift")  # what is held stays attached


@pytest.mark.parametrize("stage", ["retreat", *rare("lower", "approach", "open")])
def test_placing_can_be_cancelled_in_each_stage(stage: str) -> None:
    bench = holding()
    bench.during = lambda now: bench.task.cancel() if now == stage else None
    assert failed(bench, PLACE)[:2] == (stage, "interrupted")
    assert (bench.scene.objects["target"].link == "right_arm_tip") is (stage != "retreat")


def test_what_was_lost_on_the_way_is_not_put_down() -> None:
    bench = holding()
    bench.slips = 0.02
    stage, reason, text = failed(bench, PLACE)
    assert (stage, reason) == ("choose", "nothing_held")
    assert text == "'target' was lost on the way: the gripper closes to 0 mm"
    assert bench.scene.objects["target"].link == ROOT


def test_an_occupied_place_tells_what_is_there() -> None:
    bench = holding(box("pot", (0.12, 0.12, 0.1), (0.24, -0.20, 0.756)))
    stage, reason, text = failed(bench, PlaceObject.Goal(on="table", x=-0.05, y=-0.20))
    assert (stage, reason) == ("lower", "goal_in_collision")
    assert "'pot'" in text
    assert bench.scene.objects["target"].link == "right_arm_tip"


def test_places_that_are_none_say_so() -> None:
    bench = holding()
    assert failed(bench, PlaceObject.Goal(spot="table_left"))[1:] == (
        "unknown_goal",
        "there is no spot 'table_left'; the spots of this arm: table_right",
    )
    assert failed(bench, PlaceObject.Goal(on="shelf"))[1] == "unknown_object"
    assert failed(bench, PlaceObject.Goal(frame="nose"))[1] == "unknown_goal"
    assert failed(bench, PlaceObject.Goal(x=math.nan))[1] == "unknown_goal"
    assert failed(bench, PlaceObject.Goal(x=2.0, z=0.7))[:2] == ("lower", "goal_out_of_reach")


def test_a_thing_that_comes_in_the_way_stops_a_line() -> None:
    bench = HandBench()

    def obstruct(stage: str) -> None:
        if stage == "lift" and "late" not in bench.scene.objects:
            bench.scene.add(box("late", (0.1, 0.1, 0.02), (0.24, 0.0, 0.87)))
            bench.works.place_objects(bench.objects)
            bench.task.look_again()

    bench.during = obstruct
    stage, reason, text = failed(bench, PICK)
    assert (stage, reason) == ("lift", "path_in_collision")
    assert "'late'" in text


def test_grasps_of_the_manifest_take_the_place_of_those_of_the_shape() -> None:
    bench = HandBench()
    assert bench.config.hand is not None
    turned = {"yaw": "0.3 rad", "width": "3 cm"}
    hand = bench.config.hand.model_copy(update={"grasps": {"target": [GraspModel.model_validate(turned)]}})
    bench.config = bench.config.model_copy(update={"hand": hand})
    assert bench.carried_out(PICK).failure is None
    assert bench.openings == pytest.approx([0.06, 0.03])
    held = bench.scene.objects["target"].pose.rotation
    assert abs(held[2]) == pytest.approx(abs(quaternion_from_rpy(0, 0, -0.3)[2]), abs=0.01)


def moving(bench: HandBench, *places: tuple[str, float] | tuple[str, None]) -> None:
    """Let the target be elsewhere in stages: `y` [m], or gone."""
    waiting = list(places)

    def during(stage: str) -> None:
        if not waiting or waiting[0][0] != stage or not isinstance(bench.task, HandTask):
            return
        y = waiting.pop(0)[1]
        if y is None:
            bench.scene.remove("target")
        else:
            bench.scene.put(replace(bench.scene.objects["target"], pose=Transform3((0.24, y, 0.765))))
        bench.works.place_objects(bench.objects)
        bench.task.look_again()

    bench.during = during


@pytest.mark.parametrize("stage", ["grasp", *rare("approach")])
def test_an_object_that_has_moved_is_approached_again_and_grasped_where_it_is(stage: str) -> None:
    bench = HandBench()
    moving(bench, (stage, 0.03))
    assert bench.carried_out(PICK).failure is None
    assert bench.stages.count("choose") == 2
    x, y, z = bench.place_of("target")
    assert (x, y) == pytest.approx((0.24, 0.03), abs=5e-3)
    assert z > 0.8


def test_an_object_that_never_rests_or_is_taken_away_is_given_up() -> None:
    bench = HandBench()
    moving(bench, *(("grasp", 0.03 * (-1) ** turn) for turn in range(9)))
    assert failed(bench, PICK) == ("grasp", "nothing_grasped", "'target' does not stay where it is")
    bench = HandBench()
    moving(bench, ("grasp", None))
    stage, reason, text = failed(bench, PICK)
    assert (stage, reason) == ("choose", "unknown_object")
    assert "there is no object 'target' in the scene" in text
    assert not bench.scene.objects.get("target")


@for_all("angle, is_held", [(-0.3, True), (0.1, False)])
def test_a_cancelled_pick_holds_the_object_if_the_fingers_come_to_rest_at_it(angle: float, is_held: bool) -> None:
    bench = HandBench()

    def during(stage: str) -> None:
        if stage == "close":
            bench.task.cancel()
            bench.measured[FINGER] = (0.2, -1.0)  # it brakes

    def after_step() -> None:
        if bench.measured[FINGER][1]:
            bench.measured[FINGER] = (angle, 0.0)

    bench.during, bench.after_step = during, after_step
    assert failed(bench, PICK)[:2] == ("close", "interrupted")
    assert (bench.scene.objects["target"].link == "right_arm_tip") is is_held
    assert bench.carried_out(MoveArm.Goal(pose="resting")).failure is None


def test_what_is_placed_may_touch_the_fingers_if_the_tip_is_a_frame_beside_them() -> None:
    bench = HandBench()
    bench.config = bench.config.model_copy(update={"tip": "right_gripper_grasp"})
    bench.works = ArmWorks(bench.config, lambda: 0.0, bench.objects)
    assert bench.carried_out(PICK).failure is None
    assert "right_gripper_finger_link" in bench.scene.objects["target"].touches
    assert bench.carried_out(PLACE).failure is None
    assert math.dist(bench.place_of("target"), SPOT) < 0.02 + 3e-3


def test_a_box_without_upright_sides_is_not_called_too_wide() -> None:
    leaning = replace(box("other", (0.02, 0.02, 0.12), (0.24, 0.0, 0.8)), pose=Transform3((0.24, 0.0, 0.8), LEANING))
    bench = HandBench(leaning, without=("target",))
    text = "'other' leans: fingers close across upright sides"
    assert failed(bench, PickObject.Goal(object="other")) == ("choose", "no_grasps", text)
