"""The page of the body in 3D in a real browser, which draws by software."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from io import BytesIO
from typing import Any

import pytest
from PIL import Image as Picture
from playwright.sync_api import Page, expect

from tests.console.browser import CHROMIUM
from tests.console.fake_gateway import FakeGateway
from tests.console.looks import PHONE, overflows, too_small, violations
from tests.console.test_page_robot import DESCRIBED, component, port

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")

URDF = b"""<robot name="crane">
  <link name="base"><visual><geometry><box size="0.4 0.4 0.2"/></geometry></visual></link>
  <link name="arm">
    <visual><origin xyz="0.3 0 0"/><geometry><cylinder radius="0.05" length="0.6"/></geometry></visual>
  </link>
  <link name="tip"/>
  <joint name="turn_joint" type="revolute">
    <parent link="base"/><child link="arm"/><axis xyz="0 0 1"/><origin xyz="0 0 0.2"/>
    <limit lower="-1.5707963267948966" upper="1.5707963267948966" effort="1" velocity="1"/>
  </joint>
  <joint name="slide_joint" type="prismatic">
    <parent link="arm"/><child link="tip"/><axis xyz="1 0 0"/><limit lower="0" upper="0.05" effort="1" velocity="1"/>
  </joint>
</robot>"""
SERVOS = component(
    "servos",
    "servo_bus",
    port("crane_move", "serves_action", "/crane/move", "rbxcompose_msgs/action/MoveJoints"),
    capabilities={"BoundsGoals": [{"goals": "crane_move", "joints": {"turn": "turn_joint"}}]},
)
ARM = component(
    "arm",
    "arm",
    port("locate", "serves", "/arm/locate", "rbxcompose_msgs/srv/LocateArm"),
    port("inverse", "serves", "/arm/compute_ik", "moveit_msgs/srv/GetPositionIK"),
    port("motion", "serves_action", "/arm/move_action", "moveit_msgs/action/MoveGroup"),
    port("given", "serves_action", "/arm/execute", "moveit_msgs/action/ExecuteTrajectory"),
)
TIP = {"success": True, "x": 0.6, "y": 0.0, "z": 0.2, "roll": 0.0, "pitch": 0.0, "yaw": 0.0}
WAY = {
    "joint_trajectory": {
        "joint_names": ["turn_joint"],
        "points": [
            {"positions": [at], "time_from_start": {"sec": second, "nanosec": 0}}
            for second, at in enumerate((0.0, 1.0))
        ],
    }
}


@pytest.fixture
def crane(gateway: FakeGateway) -> FakeGateway:
    gateway.files["/console/model.urdf"] = URDF
    gateway.windows[DESCRIBED] = [SERVOS, ARM]
    gateway.latched["/joint_states"] = {"name": ["turn_joint", "slide_joint"], "position": [0.5, 0.01]}
    solution = {"joint_state": {"name": ["turn_joint"], "position": [1.0]}}
    gateway.answers |= {
        "/arm/locate": lambda _: TIP,
        "/arm/compute_ik": lambda _: {"error_code": {"val": 1}, "solution": solution},
        **dict.fromkeys(("/crane/move", "/arm/move_action", "/arm/execute"), lambda _: {}),
    }
    return gateway


def scene(page: Page, name: str) -> Any:
    return json.loads(page.locator(".scene").get_attribute(f"data-{name}") or "null")


def test_the_body_is_drawn_and_moves_with_its_joints(open_page: Callable[..., Page], crane: FakeGateway) -> None:
    page = open_page(page_name="model")
    expect(page.locator(".scene")).to_have_attribute("data-drawn", "2")
    expect(page.get_by_label("Turn -90 to 90")).to_have_value("28.5")
    expect(page.get_by_label("Slide 0 to 50")).to_have_value("10")
    shown = Picture.open(BytesIO(page.locator(".scene").screenshot())).convert("RGB")
    middle = shown.getpixel((shown.width // 2, shown.height // 2))
    assert middle != shown.getpixel((20, 20))  # the body, before the ground
    page.get_by_text("Links (3)").click()
    page.get_by_label("Axes of tip").check()
    page.get_by_label("Opacity of arm").fill("50")
    assert violations(page) == []


def test_sliders_move_a_ghost_unless_they_may_move_the_robot(
    open_page: Callable[..., Page], crane: FakeGateway
) -> None:
    page = open_page(page_name="model")
    turn = page.get_by_label("Turn -90 to 90")
    expect(turn).to_have_value("28.5")
    turn.fill("45")
    assert scene(page, "ghost")["turn_joint"] == pytest.approx(math.pi / 4)
    assert crane.goals() == []
    page.get_by_role("button", name="Centre").click()
    assert scene(page, "ghost") == {"turn_joint": 0, "slide_joint": 0}
    page.get_by_label("Move the joints of the robot").check()
    assert scene(page, "ghost") is None
    turn.fill("-30")
    expect(page.locator(".scene")).to_have_attribute("data-ghost", "")
    expect(page.get_by_text("Nothing of the robot moves")).to_be_hidden()
    (goal,) = crane.goals()
    assert (goal["action"], goal["args"]["joints"]) == ("/crane/move", ["turn"])
    assert goal["args"]["positions"] == [pytest.approx(-math.pi / 6)]
    page.get_by_label("Slide 0 to 50").fill("20")
    expect(page.get_by_text("Nothing of the robot moves slide joint by a goal")).to_be_visible()


def test_a_goal_of_an_arm_is_planned_shown_and_executed(open_page: Callable[..., Page], crane: FakeGateway) -> None:
    page = open_page(page_name="model", reduced_motion="reduce")
    page.get_by_role("button", name="Drag its tip").click()
    x = page.get_by_label("X cm")
    expect(x).to_have_value("60")
    x.fill("50")
    page.get_by_role("button", name="Plan").click()
    expect(page.get_by_text("Planning")).to_be_visible()
    (ask,) = crane.calls("/arm/compute_ik")
    assert ask["ik_request"]["pose_stamped"]["pose"]["position"] == {"x": 0.5, "y": 0, "z": 0.2}
    expect(page.locator(".scene")).to_have_attribute("data-ghost", re.compile("turn_joint"))
    (plan,) = crane.goals()
    assert plan["args"]["planning_options"] == {"plan_only": True}
    crane.act("action_result", plan, {"planned_trajectory": WAY, "error_code": {"val": 1}}, status=4, result=True)
    expect(page.get_by_text("A way of 1.0\u202fs")).to_be_visible()
    assert scene(page, "ghost") == {"turn_joint": 1}
    page.get_by_role("button", name="Execute").click()
    expect(page.get_by_text("Moving")).to_be_visible()
    go = crane.goals()[-1]
    assert go["args"]["trajectory"] == WAY
    crane.act("action_result", go, {"error_code": {"val": 1}}, status=4, result=True)
    expect(page.get_by_text("It is there.")).to_be_visible()
    assert violations(page) == []


def test_a_pose_that_cannot_be_reached_says_why_and_nothing_is_executed(
    open_page: Callable[..., Page], crane: FakeGateway
) -> None:
    why = {"val": -31, "message": "the tip got within 7.5 cm of it"}
    crane.answers["/arm/compute_ik"] = lambda _: {"error_code": why}
    page = open_page(page_name="model")
    page.get_by_role("button", name="Drag its tip").click()
    expect(page.get_by_label("X cm")).to_have_value("60")
    page.get_by_role("button", name="Plan").click()
    expect(page.get_by_text("The tip cannot be there: the tip got within 7.5 cm of it")).to_be_visible()
    expect(page.get_by_role("button", name="Execute")).to_be_disabled()
    assert crane.goals() == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_a_phone(open_page: Callable[..., Page], crane: FakeGateway, scheme: str) -> None:
    page = open_page(page_name="model", viewport=PHONE, color_scheme=scheme, has_touch=True)
    page.get_by_role("button", name="Drag its tip").click()
    expect(page.get_by_label("X cm")).to_have_value("60")
    assert not overflows(page)
    assert too_small(page) == []
    assert violations(page) == []


def test_meshes_that_are_missing_are_named(open_page: Callable[..., Page], crane: FakeGateway) -> None:
    mesh = b'<mesh filename="/console/meshes/0/face.stl"/>'
    crane.files["/console/model.urdf"] = URDF.replace(b'<box size="0.4 0.4 0.2"/>', mesh)
    crane.files["/console/meshes/0/face.stl"] = b"no mesh"
    page = open_page(page_name="model")
    expect(page.get_by_text("cannot be read: face.stl")).to_be_visible()


def test_a_robot_without_a_body_says_so(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    gateway.files.clear()
    page = open_page(page_name="parameters")
    page.evaluate("fetch = () => Promise.resolve(new Response('', {status: 404}))")
    page.get_by_role("link", name="Model").click()
    expect(page.get_by_text("This robot has no body.")).to_be_visible()
