"""The pieces of bodies that ship: each is whole with any sizes, stands on the ground, and moves the way it says."""

from __future__ import annotations

import math
import random
import re
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml

from rbxcompose.base.findings import Span
from rbxcompose.base.geometry import Transform3, Vector3
from rbxcompose.base.units import parse_quantity
from rbxcompose.domains.body.lint import lint
from rbxcompose.domains.body.model import Body
from rbxcompose.domains.body.urdf import read_body
from rbxcompose.domains.body.xacro import Expanded, XacroFile, expand_all
from rbxcompose.domains.body.xml_reader import XmlElement, read_urdf
from tests.loops import for_all
from tests.soak import rare

PARTS = Path(__file__).parents[2] / "parts"
HERE = Span("robot.yaml", 1, 1, 1, 1)
ARM = ["shoulder_pan", "shoulder_lift", "shoulder_roll", "elbow_flex", "forearm_flex", "wrist_flex"]
ROLLING = ["shoulder_pan", "shoulder_lift", "upperarm_roll", "elbow_flex", "forearm_roll", "wrist_flex", "wrist_roll"]
CAMERA = ["link", "depth_frame", "depth_optical_frame", "rgb_frame", "rgb_optical_frame"]
BASE = (
    "footprint",
    ["link", "l_wheel_link", "r_wheel_link", "front_caster_link", "rear_caster_link", "top"],
    ["l_wheel_joint", "r_wheel_joint"],
    (4.0, 7.0),
)
WHOLE: dict[str, tuple[str, list[str], list[str], tuple[float, float]]] = {  # root, more frames, moving joints, mass
    "box_base": BASE,
    "cylinder_base": BASE,
    "torso": ("link", ["top"], [], (0.5, 1.0)),
    "telescoping_torso": ("link", ["inner_link", "top"], ["joint"], (0.7, 1.5)),
    "kinect": ("link", CAMERA, [], (0.5, 1.5)),
    "xtion": ("link", CAMERA, [], (0.15, 0.3)),
    "laser": ("link", ["frame"], [], (0.1, 0.4)),
    "pan_tilt_head": ("base_link", ["pan_link", "tilt_link", "top"], ["pan_joint", "tilt_joint"], (0.12, 0.25)),
    "arm": ("base_link", [*(f"{text}_link" for text in ARM), "tip"], [f"{text}_joint" for text in ARM], (0.4, 0.8)),
    "roll_arm": ("base_link", ["tip"], [f"{text}_joint" for text in ROLLING], (5, 12)),
    "lift": ("link", ["carriage_link", "shoulder", "top"], ["joint"], (20, 25)),
    "parallel_gripper": ("link", ["right_finger_link", "grasp"], ["left_finger_joint"], (1, 2)),
    "gripper": ("link", ["static_finger_link", "finger_link", "grasp"], ["finger_joint"], (0.1, 0.3)),
}
OFTEN = ("box_base", "cylinder_base", "arm", "lift")
"""Those that are tried in other sizes; others are under `--soak` alone."""
PIECES = sorted(path.name.split(".")[0] for path in PARTS.glob("body/*.urdf.xacro"))
MIRRORED = {f"{text}_joint" for text in ARM} - {"shoulder_lift_joint", "forearm_flex_joint"}  # turn the other way


def defaults(name: str) -> dict[str, str]:
    """Return the arguments of a piece with their defaults."""
    text = (PARTS / f"body/{name}.urdf.xacro").read_text(encoding="utf-8")
    return dict(re.findall(r'<xacro:arg name="(\w+)" default="([^"]+)"', text))


def scaled(name: str) -> dict[str, str]:
    """Return other values for all arguments of a piece."""
    words = {"ax12": "mx28"}
    return {key: words.get(value) or str(1.3 * float(value)) for key, value in defaults(name).items()} | (
        {"reflect": "1"} if "reflect" in defaults(name) else {}
    )


def xacro(name: str, arguments: dict[str, str]) -> XacroFile:
    return XacroFile(PARTS / f"body/{name}.urdf.xacro", arguments, {"rbxcompose": PARTS.parent}, [PARTS], HERE)


@pytest.fixture(scope="module", autouse=True)
def _expanded_at_once() -> None:
    """Expand all pieces in one process; its answers are kept."""
    expand_all([*(xacro(name, {}) for name in WHOLE), *(xacro(name, scaled(name)) for name in OFTEN)])


@cache
def piece(name: str, **arguments: str) -> Body:
    """Return the body of a piece, in which nothing is wrong."""
    [(expanded, _)] = expand_all([xacro(name, arguments)])
    assert isinstance(expanded, Expanded), expanded
    root = read_urdf(expanded.located, name)
    assert isinstance(root, XmlElement), root
    body, findings = read_body(root)
    assert [*findings, *lint(body, ())] == []
    return body


def manifest(name: str) -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load((PARTS / f"{name}.yaml").read_text(encoding="utf-8"))
    return found


def direction(frame: Transform3, axis: Vector3) -> Vector3:
    x, y, z = frame.translation
    a, b, c = frame.apply(axis)
    return a - x, b - y, c - z


def mirrored(point: Vector3) -> Vector3:
    x, y, z = point
    return x, -y, z


def rounded(point: Vector3) -> Vector3:
    x, y, z = (round(number, 9) + 0.0 for number in point)
    return x, y, z


def test_all_pieces_are_known() -> None:
    assert sorted(WHOLE) == PIECES


@for_all("name", WHOLE)
def test_a_piece_has_its_frames_joints_and_mass(name: str) -> None:
    root, frames, joints, (least, most) = WHOLE[name]
    body = piece(name)
    assert body.name == name
    assert body.root == root
    assert {*frames} <= body.links.keys()
    assert [joint.name for joint in body.moving] == joints
    assert least <= sum(link.inertial.mass for link in body.links.values() if link.inertial) <= most


@pytest.mark.parametrize("name", [*OFTEN, *rare(*(name for name in WHOLE if name not in OFTEN))])
def test_a_piece_may_have_other_sizes(name: str) -> None:
    usual, other = piece(name), piece(name, **scaled(name))
    assert other.links.keys() == usual.links.keys()
    assert other.joints.keys() == usual.joints.keys()
    assert other != usual


@for_all("name", WHOLE)
def test_a_part_passes_all_arguments_of_its_piece_with_the_same_defaults(name: str) -> None:
    part = manifest(name)
    given = {key: value.removeprefix("${args.").removesuffix("}") for key, value in part["body"]["with"].items()}
    assert part["body"]["xacro"] == f"body/{name}.urdf.xacro"
    assert given.keys() == defaults(name).keys()
    for key, default in defaults(name).items():
        told = part["args"][given[key]]
        if told["type"] == "choice":
            assert told["default"] == default
        else:
            assert parse_quantity(str(told["default"])).value == pytest.approx(float(default), rel=1e-3)


@pytest.mark.parametrize("name", ["box_base", "cylinder_base"])
def test_a_base_drives_like_the_simulated_base(name: str) -> None:
    part, base = manifest(name), manifest("base")
    assert {key: part[key] for key in base if key not in {"name", "about", "args"}} == {
        key: base[key] for key in base if key not in {"name", "about", "args"}
    }
    assert {key: part["args"][key] for key in base["args"]} == base["args"]


@pytest.mark.parametrize("name", ["box_base", "cylinder_base"])
@pytest.mark.parametrize("sizes", ["usual", "other"])
def test_wheels_and_casters_touch_the_ground(name: str, sizes: str) -> None:
    body = piece(name, **(scaled(name) if sizes == "other" else {}))
    poses = body.poses({})
    for link in ("l_wheel_link", "r_wheel_link", "front_caster_link", "rear_caster_link"):
        (shape,) = body.links[link].visuals
        assert poses[link].translation[2] == pytest.approx(shape.geometry.size[0], abs=1e-12)
    left, right = poses["l_wheel_link"], poses["r_wheel_link"]
    assert left.translation == pytest.approx(mirrored(right.translation), abs=1e-12)
    assert direction(left, (0, 0, 1)) == pytest.approx((0, 1, 0), abs=1e-12)  # forwards is positive


@pytest.mark.parametrize("name", ["arm", *rare("gripper")])
def test_reflect_mirrors_exactly(name: str) -> None:
    right, left = piece(name, reflect="-1"), piece(name, reflect="1")
    numbers = random.Random(7)
    for _ in range(50):
        positions = {joint.name: numbers.uniform(-3, 3) for joint in right.moving}
        opposite = {key: -value if key in MIRRORED else value for key, value in positions.items()}
        there, here = right.poses(positions), left.poses(opposite)
        for link, pose in there.items():
            assert here[link].apply((0.1, -0.2, 0.3)) == pytest.approx(mirrored(pose.apply((0.1, 0.2, 0.3))), abs=1e-9)


@pytest.mark.parametrize("name", ["arm", "gripper"])
def test_reflect_mirrors_all_shapes(name: str) -> None:
    right, left = piece(name, reflect="-1"), piece(name, reflect="1")
    for link in right.links.values():
        there = {(rounded(mirrored(visual.origin.translation)), visual.geometry.size) for visual in link.visuals}
        assert {
            (rounded(visual.origin.translation), visual.geometry.size) for visual in left.links[link.name].visuals
        } == there


def test_the_arm_hangs_down_and_is_stretched_forwards_by_its_lift() -> None:
    body = piece("arm")
    hanging, forwards = body.poses({}), body.poses({"shoulder_lift_joint": -math.pi / 2})
    length = 0.125 + 0.077 + 0.062 + 0.038
    shoulder = hanging["shoulder_lift_link"].translation
    assert hanging["tip"].translation == pytest.approx((*shoulder[:2], shoulder[2] - length), abs=1e-12)
    assert forwards["tip"].translation == pytest.approx((length, *shoulder[1:]), abs=1e-12)
    for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
        assert direction(forwards["tip"], axis) == pytest.approx(axis, abs=1e-12)
    assert shoulder[1] < 0  # to the right
    panned = body.poses({"shoulder_lift_joint": -math.pi / 2, "shoulder_pan_joint": 0.5})
    assert direction(panned["tip"], (1, 0, 0))[1] > 0  # to the left


def test_the_arm_that_rolls_is_stretched_forwards_and_its_positive_lift_lowers_it() -> None:
    body = piece("roll_arm")
    shoulder, tip = (body.poses({})[link] for link in ("shoulder_lift_link", "tip"))
    assert tip.rotation == (0.0, 0.0, 0.0, 1.0)
    assert tip.translation == pytest.approx((shoulder.translation[0] + 0.878, *shoulder.translation[1:]))
    assert body.poses({"shoulder_lift_joint": 0.3})["tip"].translation[2] < tip.translation[2]
    rolling = {joint.name for joint in body.moving if joint.kind == "continuous"}
    assert rolling == {f"{text}_roll_joint" for text in ("upperarm", "forearm", "wrist")}


def test_the_head_pans_left_and_tilts_down() -> None:
    poses = piece("pan_tilt_head").poses({"pan_joint": 0.5, "tilt_joint": 0.3})
    _, left, up = direction(poses["top"], (1, 0, 0))
    assert left > 0
    assert up < 0


@pytest.mark.parametrize("name", ["kinect", "xtion"])
def test_optical_frames_look_forwards_with_y_down(name: str) -> None:
    poses = piece(name).poses({})
    for eye, side in (("depth", 1), ("rgb", -1)):
        frame = poses[f"{eye}_optical_frame"]
        assert direction(frame, (0, 0, 1)) == pytest.approx((1, 0, 0), abs=1e-12)
        assert direction(frame, (0, 1, 0)) == pytest.approx((0, 0, -1), abs=1e-12)
        assert frame.translation[1] == pytest.approx(side * 0.0125)


def test_the_gripper_closes_at_its_lower_limit() -> None:
    body = piece("gripper")
    joint = body.joints["finger_joint"]
    assert joint.limits
    assert (joint.limits.lower, joint.limits.upper) == (-0.8, 0.5)
    ends = [body.poses({"finger_joint": at})["finger_link"].apply((0.1, 0, 0))[1] for at in (-0.8, 0.0, 0.5)]
    still = body.poses({})["static_finger_link"].translation[1]
    distances = [abs(end - still) for end in ends]
    assert distances == sorted(distances)
    assert distances[0] == pytest.approx(0.006, abs=0.001)  # as thick as a finger
    assert distances[1] == pytest.approx(0.072 + 0.006)


def test_the_inner_post_stays_in_the_outer_one() -> None:
    body = piece("telescoping_torso")
    joint = body.joints["joint"]
    assert joint.limits
    outer = body.links["link"].visuals[0].geometry.size[2]
    for position in (joint.limits.lower, 0.0, joint.limits.upper):
        assert position is not None
        poses = body.poses({"joint": position})
        assert 0 <= poses["inner_link"].translation[2] <= outer - 0.1 + 1e-9
        assert poses["top"].translation[2] == pytest.approx(0.7 + position)
