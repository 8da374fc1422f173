"""The page of the body in 3D in a real browser, which draws by software."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from PIL import Image as Picture
from playwright.sync_api import Page, expect

from tests.console.browser import CHROMIUM
from tests.console.fake_gateway import FakeGateway
from tests.console.looks import PHONE, expect_fit, violations
from tests.console.test_page import wait_for
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

WORLD = component("world", "world", port("world", "out", "/world", "rbxcompose_msgs/msg/World"))
LASER = component("laser", "laser_sim", port("scan", "out", "/scan", "sensor_msgs/msg/LaserScan"))
BEGAN = 1_000  # [s], the stamp of the world at 5 s of robot time
TURN = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
ORIGIN = {"position": {"x": -2.0, "y": -2.0, "z": 0.0}, "orientation": TURN}


def transforms(parent: str, child: str, x: float, after: float = 0.0) -> dict[str, Any]:
    """Return a message with a transform, published so long [s] after the world."""
    header = {"frame_id": parent, "stamp": {"sec": BEGAN + int(after), "nanosec": int(after % 1 * 1e9)}}
    place = {"translation": {"x": x, "y": 0.0, "z": 0.0}, "rotation": TURN}
    return {"transforms": [{"header": header, "child_frame_id": child, "transform": place}]}


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


@pytest.fixture
def crane_in_world(crane: FakeGateway) -> FakeGateway:
    """A crane in a room of 4 m, in which a blue ton goes from y = -1 to y = 1 in 10 s."""
    around = [100 if 0 in (row, column) or 39 in (row, column) else 0 for row in range(40) for column in range(40)]
    header = {"frame_id": "map", "stamp": {"sec": BEGAN, "nanosec": 0}}
    info = {"width": 40, "height": 40, "resolution": 0.1, "origin": ORIGIN}
    ton = {"name": "ton", "kind": "cylinder", "size": [0.3, 0.9], "x": 1.0, "y": -1.0, "z": 0.0, "heading": 0.0}
    path = {"times": [0.0, 10.0], "xs": [1.0, 1.0], "ys": [-1.0, 1.0], "repeats": False, "colour": "blue"}
    room = {"header": header, "info": info, "data": around}
    crane.latched["/world"] = {"name": "room", "map": room, "shapes": [ton | path], "time": 5.0}
    crane.latched["/tf_static"] = transforms("map", "odom", 0.0)
    crane.latched["/tf"] = transforms("odom", "base", 0.0)
    crane.windows[DESCRIBED] = [*crane.windows[DESCRIBED], WORLD, LASER]
    return crane


def middle_of_blue(page: Page) -> tuple[float, float] | None:
    """Return where the blue pixels are in the picture, on average."""
    shown = np.asarray(Picture.open(BytesIO(page.locator(".scene").screenshot())).convert("RGB")).astype(int)
    rows, columns = np.nonzero((shown[..., 2] > shown[..., 0] + 80) & (shown[..., 0] < 110))
    return (float(columns.mean()), float(rows.mean())) if len(rows) else None


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


def test_a_body_that_could_not_be_loaded_is_loaded_once_connected(
    open_page: Callable[..., Page], crane: FakeGateway
) -> None:
    page = open_page(page_name="parameters")
    crane.is_away = True
    crane.drop()
    expect(page.locator(".connection")).to_contain_text("Not connected")
    page.get_by_role("link", name="Model").click()
    expect(page.get_by_text("The robot's model cannot be loaded: not connected.")).to_be_visible()
    crane.is_away = False
    expect(page.locator(".scene")).to_have_attribute("data-drawn", "2")


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
    wait_for(lambda: scene(page, "ghost") is None, page)
    turn.fill("-30")
    expect(page.locator(".scene")).to_have_attribute("data-ghost", "")
    expect(page.get_by_text("Nothing of the robot moves")).to_be_hidden()
    wait_for(crane.goals, page)
    (goal,) = crane.goals(1)
    assert (goal["action"], goal["args"]["joints"]) == ("/crane/move", ["turn"])
    assert goal["args"]["positions"] == [pytest.approx(-math.pi / 6)]
    expect(page.get_by_label("Slide 0 to 50")).to_be_disabled()
    expect(page.get_by_title("Nothing of the robot moves slide by a goal.")).to_be_visible()
    page.get_by_label("Move the joints of the robot").uncheck()
    expect(page.get_by_label("Slide 0 to 50")).to_be_enabled()


def test_a_goal_of_joints_that_ends_early_is_said_and_the_sliders_follow_the_robot(
    open_page: Callable[..., Page], crane: FakeGateway
) -> None:
    page = open_page(page_name="model")
    turn, slide = page.get_by_label("Turn -90 to 90"), page.get_by_label("Slide 0 to 50")
    expect(slide).to_have_value("10")
    page.get_by_label("Move the joints of the robot").check()
    page.get_by_role("button", name="Centre").click()
    expect(turn).to_have_value("0")
    expect(slide).to_have_value("10")  # nothing moves it
    (goal,) = crane.goals(1)
    crane.act("action_result", goal, {"message": "blocked"}, status=6, result=True)
    expect(page.get_by_text("Turn stopped: blocked.")).to_be_visible()
    crane.say("/joint_states", {"name": ["turn_joint", "slide_joint"], "position": [0.25, 0.01]})
    expect(turn).to_have_value("14.5")
    turn.fill("30")
    expect(page.get_by_text("Turn stopped: blocked.")).to_be_hidden()


def test_joints_of_a_stopped_robot_are_not_moved(open_page: Callable[..., Page], crane: FakeGateway) -> None:
    crane.answers |= dict.fromkeys(("/console/stop", "/console/release"), lambda _: {"success": True, "message": ""})
    page = open_page(page_name="model")
    turn = page.get_by_label("Turn -90 to 90")
    page.get_by_label("Move the joints of the robot").check()
    page.get_by_role("button", name="STOP").click()
    expect(turn).to_be_disabled()
    expect(page.get_by_text("The robot is stopped.")).to_be_visible()
    page.get_by_role("button", name="Randomize").click()
    page.get_by_role("button", name="Release").click()
    expect(turn).to_be_enabled()
    expect(page.get_by_text("The robot is stopped.")).to_be_hidden()
    assert crane.goals() == []


@pytest.mark.soak  # a real robot shows its world in the tests of its gateway
def test_the_robot_stands_in_its_world_in_which_things_move(
    open_page: Callable[..., Page], crane_in_world: FakeGateway
) -> None:
    page = open_page(page_name="model")
    expect(page.locator(".scene")).to_have_attribute("data-world", "1")
    page.get_by_role("button", name="Top", exact=True).click()
    expect(page.locator(".scene")).to_have_attribute("data-time", "5")
    first = middle_of_blue(page)
    crane_in_world.say("/tf", transforms("odom", "base", 0.0, after=5.0))
    expect(page.locator(".scene")).to_have_attribute("data-time", "10")
    second = middle_of_blue(page)
    crane_in_world.say("/tf", transforms("odom", "base", 0.5, after=5.0))
    expect(page.locator(".scene")).to_have_attribute("data-place", "[0.5,0,0]")
    third = middle_of_blue(page)
    assert first
    assert second
    assert third
    assert math.dist(first, second) > 150  # [px]: the ton went on by 1 m
    assert math.dist(second, third) > 75  # the camera goes with the robot
    assert violations(page) == []
    page.get_by_label("World", exact=True).uncheck()
    expect(page.locator(".scene")).to_have_attribute("data-world", "")
    assert middle_of_blue(page) is None
    page.reload()
    expect(page.get_by_label("World", exact=True)).not_to_be_checked()
    assert middle_of_blue(page) is None


@pytest.mark.soak
def test_a_robot_without_a_world_is_asked_for_nothing_of_it(open_page: Callable[..., Page], crane: FakeGateway) -> None:
    page = open_page(page_name="model")
    expect(page.get_by_role("button", name="Drag its tip")).to_be_visible()
    expect(page.get_by_label("World", exact=True)).to_be_hidden()
    asked = {frame["topic"] for _, frame in crane.frames if frame["op"] == "subscribe"}
    assert not asked & {"/world", "/tf", "/tf_static", "/scan"}


def test_a_goal_of_an_arm_is_planned_shown_and_executed(open_page: Callable[..., Page], crane: FakeGateway) -> None:
    page = open_page(page_name="model", reduced_motion="reduce")
    page.get_by_role("button", name="Drag its tip").click()
    x = page.get_by_label("X cm")
    expect(x).to_have_value("60")
    x.fill(" ")
    page.get_by_role("button", name="Plan").click()
    expect(page.get_by_text("Each of the six must be a number.")).to_be_visible()
    assert crane.calls("/arm/compute_ik") == []
    x.fill("50")
    page.get_by_role("button", name="Plan").click()
    expect(page.get_by_text("Planning")).to_be_visible()
    (ask,) = crane.calls("/arm/compute_ik", 1)
    assert ask["ik_request"]["pose_stamped"]["pose"]["position"] == {"x": 0.5, "y": 0, "z": 0.2}
    expect(page.locator(".scene")).to_have_attribute("data-ghost", re.compile("turn_joint"))
    (plan,) = crane.goals(1)
    assert plan["args"]["planning_options"] == {"plan_only": True}
    crane.act("action_result", plan, {"planned_trajectory": WAY, "error_code": {"val": 1}}, status=4, result=True)
    expect(page.get_by_text("A way of 1.0\u202fs")).to_be_visible()
    assert scene(page, "ghost") == {"turn_joint": 1}
    page.get_by_role("button", name="Execute").click()
    expect(page.get_by_text("Moving")).to_be_visible()
    go = crane.goals(2)[-1]
    assert go["args"]["trajectory"] == WAY
    page.get_by_role("button", name="Let go of its tip").click()
    page.get_by_role("link", name="Log").click()
    page.get_by_role("link", name="Model").click()  # the arm moves on, and can be canceled
    expect(page.get_by_text("Moving")).to_be_visible()
    expect(page.get_by_role("button", name="Cancel")).to_be_enabled()
    crane.act("action_result", go, {"error_code": {"val": 1}}, status=4, result=True)
    expect(page.get_by_text("It is there.")).to_be_visible()
    expect(page.get_by_role("button", name="Cancel")).to_be_hidden()
    assert violations(page) == []


@pytest.mark.soak
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


@pytest.mark.soak  # as the Drive page does, of the same parts
def test_it_fits_a_phone(open_page: Callable[..., Page], crane: FakeGateway) -> None:
    crane.windows[DESCRIBED] = [*crane.windows[DESCRIBED], WORLD]
    page = open_page(page_name="model", viewport=PHONE, has_touch=True)
    expect(page.get_by_label("World", exact=True)).to_be_visible()
    page.get_by_role("button", name="Drag its tip").click()
    expect(page.get_by_label("X cm")).to_have_value("60")
    expect_fit(page)


@pytest.mark.soak
def test_meshes_that_are_missing_are_named(open_page: Callable[..., Page], crane: FakeGateway) -> None:
    mesh = b'<mesh filename="/console/meshes/0/face.stl"/>'
    crane.files["/console/model.urdf"] = URDF.replace(b'<box size="0.4 0.4 0.2"/>', mesh)
    crane.files["/console/meshes/0/face.stl"] = b"no mesh"
    page = open_page(page_name="model")
    expect(page.get_by_text("cannot be read: face.stl")).to_be_visible()


@pytest.mark.soak
def test_a_robot_without_a_body_says_so(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    gateway.files.clear()
    page = open_page(page_name="parameters")
    page.evaluate("fetch = () => Promise.resolve(new Response('', {status: 404}))")
    page.get_by_role("link", name="Model").click()
    expect(page.get_by_text("This robot has no body.")).to_be_visible()
