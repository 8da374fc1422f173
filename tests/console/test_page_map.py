"""The page of the map in a real browser: what stands where, and that a drag is exactly the goal that it shows."""

from __future__ import annotations

import io
import json
import math
import re
from collections.abc import Callable
from typing import Any

import PIL.Image
import pytest
from playwright.sync_api import Locator, Page, expect

from rbxcompose.base.requests import Refused
from tests.console.browser import CHROMIUM
from tests.console.fake_gateway import CONFIG, FakeGateway
from tests.console.looks import PHONE, WIDE, expect_fit, violations

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")

SCALE = 200.0  # [px/m] of a small map that fits
PLACES = {
    "dock": {"x": 0.0, "y": 0.0, "heading": 0.0, "colour": "yellow"},
    "window_seat": {"x": 1.0, "y": 0.5, "heading": math.pi / 2, "colour": ""},
}
MIDDLE = (0.5, 0.25)  # of the places
TYPES = {
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/odom": "nav_msgs/msg/Odometry",
    "/map": "nav_msgs/msg/OccupancyGrid",
    "/plan": "nav_msgs/msg/Path",
    "/scan": "sensor_msgs/msg/LaserScan",
}
NAVIGATE = "nav2_msgs/action/NavigateToPose"


def component(name: str, ports: list[dict[str, Any]], capabilities: dict[str, Any]) -> dict[str, Any]:
    plain = {"type": name, "about": "", "process": "robot", "requests": {}}
    return {"name": name, "ports": ports, "capabilities": capabilities, **plain}


GO_TO = component(
    "go_to",
    [{"name": "go_to", "kind": "serves_action", "topic": "/go_to", "type": NAVIGATE, "claims": "base"}],
    {"Navigates": [{"goals": "go_to"}]},
)
CHARGER = component("charger", [], {"Charges": [{"goals": "recharge", "place": {**PLACES["dock"], "name": "dock"}}]})


def turned(heading: float) -> dict[str, float]:
    return {"x": 0.0, "y": 0.0, "z": math.sin(heading / 2), "w": math.cos(heading / 2)}


def moved(x: float, y: float) -> dict[str, float]:
    return {"x": x, "y": y, "z": 0.0}


def transform(parent: str, child: str, x: float, y: float, heading: float) -> dict[str, Any]:
    place = {"translation": moved(x, y), "rotation": turned(heading)}
    return {"header": {"frame_id": parent}, "child_frame_id": child, "transform": place}


def pose(x: float, y: float, heading: float) -> dict[str, Any]:
    return {"position": moved(x, y), "orientation": turned(heading)}


def rolls(gateway: FakeGateway) -> None:
    """Let the robot be at (1, 0.5) in `map`, by a transform to `odom`, in which it is at (0.5, 0) and looks along x."""
    gateway.config = {**CONFIG, "places": PLACES}
    gateway.windows["robot/DescribeRobot"] = [GO_TO, CHARGER]
    gateway.answers["/go_to"] = lambda _: {"distance_remaining": 3.0}
    gateway.answers["/rosapi/topics"] = lambda _: {"topics": list(TYPES), "types": list(TYPES.values())}
    gateway.answers["/rosapi/subscribers"] = lambda _: {"subscribers": []}
    gateway.latched["/tf_static"] = {"transforms": [transform("map", "odom", 1.0, 0.0, math.pi / 2)]}
    frames = {"header": {"frame_id": "odom"}, "child_frame_id": "base_footprint"}
    gateway.repeated = {"/odom": {**frames, "pose": {"pose": pose(0.5, 0.0, 0.0)}}}


@pytest.fixture
def rolling(gateway: FakeGateway) -> FakeGateway:
    rolls(gateway)
    return gateway


def canvas(page: Page) -> Locator:
    return page.locator("map-canvas canvas")


def at(page: Page, x: float, y: float, scale: float = SCALE) -> tuple[float, float]:
    """Return where a point of the map is in the window, if the middle of the places is in that of the canvas."""
    box = canvas(page).bounding_box()
    assert box
    right, up = x - MIDDLE[0], y - MIDDLE[1]
    return box["x"] + box["width"] / 2 + scale * right, box["y"] + box["height"] / 2 - scale * up


_PIXEL = """([x, y]) => {
    const canvas = document.querySelector("map-canvas canvas");
    const box = canvas.getBoundingClientRect();
    const ratio = canvas.width / box.width;
    const copy = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
    copy.drawImage(canvas, -Math.floor((x - box.x) * ratio), -Math.floor((y - box.y) * ratio));
    return [...copy.getImageData(0, 0, 1, 1).data];
}"""


def wait_for_colour(page: Page, x: float, y: float, colour: list[int]) -> None:
    """Wait until a point of the map has a colour, RGBA."""
    same = f"([x, y, wanted]) => String(({_PIXEL})([x, y])) === String(wanted)"
    page.wait_for_function(same, arg=[*at(page, x, y), colour])


def drag(page: Page, start: tuple[float, float], end: tuple[float, float]) -> None:
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(*((a + b) / 2 for a, b in zip(start, end, strict=True)))
    page.mouse.move(*end)
    page.mouse.up()


def move_fingers(page: Page, start: list[tuple[float, float]], end: list[tuple[float, float]]) -> None:
    session = page.context.new_cdp_session(page)
    nowhere: list[tuple[float, float]] = []
    for kind, points in (("touchStart", start), ("touchMove", end), ("touchEnd", nowhere)):
        given = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(points)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": given})


def is_goal(frame: dict[str, Any], x: float, y: float, heading: float) -> bool:
    """Return whether a frame sends the robot to a pose, to the pixel."""
    sent = frame["args"]["pose"]
    assert (frame["action"], frame["action_type"]) == ("/go_to", NAVIGATE)
    assert sent["header"]["frame_id"] == "map"
    position, orientation = sent["pose"]["position"], sent["pose"]["orientation"]
    return bool(
        (position["x"], position["y"]) == pytest.approx((x, y), abs=1 / SCALE)
        and 2 * math.atan2(orientation["z"], orientation["w"]) == pytest.approx(heading, abs=0.02)
    )


def state(page: Page) -> Locator:
    return page.locator(".map-state")


def expect_drive(page: Page, name: str) -> None:
    """Wait until the robot has told how far it is from a goal, which it has."""
    expect(state(page)).to_have_text(f"Driving to {name}")
    expect(page.get_by_text("3.00\u202fm to go")).to_be_visible()


def tool(page: Page, name: str) -> Locator:
    return page.get_by_role("group", name="What a drag does").get_by_role("button", name=name, exact=True)


def test_the_robot_is_where_transforms_and_odometry_have_it(
    open_page: Callable[..., Page], rolling: FakeGateway
) -> None:
    page = open_page(page_name="map")
    expect(page.get_by_text("Robot: x 1.00\u202fm, y 0.50\u202fm, heading 90°, in map")).to_be_visible()
    wait_for_colour(page, 1.0, 0.5, [26, 95, 208, 255])
    wait_for_colour(page, 0.0, 0.045, [255, 255, 0, 255])
    rolling.say("/tf", {"transforms": [transform("odom", "base_footprint", -0.25, 0.0, math.pi)]})
    expect(page.get_by_text("Robot: x 1.00\u202fm, y \u22120.25\u202fm, heading \u221290°, in map")).to_be_visible()


def test_a_drag_is_exactly_the_goal_at_each_zoom(open_page: Callable[..., Page], rolling: FakeGateway) -> None:
    page = open_page(page_name="map")
    tool(page, "Go").click()
    drag(page, at(page, 0.2, 0.1), at(page, 0.2, 0.6))
    expect_drive(page, "(0.20, 0.10)")
    expect(tool(page, "Move view")).to_have_attribute("aria-pressed", "true")
    page.get_by_role("button", name="Zoom in").click()
    tool(page, "Go").click()
    drag(page, at(page, 0.9, 0.3, 1.3 * SCALE), at(page, 0.6, 0.0, 1.3 * SCALE))
    expect_drive(page, "(0.90, 0.30)")
    first, second = rolling.goals()
    assert is_goal(first, 0.2, 0.1, math.pi / 2)
    assert is_goal(second, 0.9, 0.3, -3 * math.pi / 4)


@pytest.mark.soak
def test_without_the_tool_a_drag_moves_the_view_and_not_the_robot(
    open_page: Callable[..., Page], rolling: FakeGateway
) -> None:
    page = open_page(page_name="map")
    expect(page.get_by_text("Robot: x 1.00")).to_be_visible()
    drag(page, at(page, 0.5, 0.2), at(page, 0.2, 0.2))
    canvas(page).press("ArrowRight")
    tool(page, "Go").click()
    drag(page, at(page, 0.0, 0.2), at(page, 0.5, 0.2))
    expect_drive(page, "(0.60, 0.20)")
    (goal,) = rolling.goals(1)
    assert is_goal(goal, 0.6, 0.2, 0.0)


@pytest.mark.soak  # as the mouse does
def test_a_finger_sends_the_same_goal_and_escape_gives_up(open_page: Callable[..., Page], rolling: FakeGateway) -> None:
    page = open_page(page_name="map", has_touch=True)
    expect(page.get_by_text("Robot: x 1.00")).to_be_visible()
    tool(page, "Go").tap()
    move_fingers(page, [at(page, 0.2, 0.1)], [at(page, 0.7, 0.1)])
    expect_drive(page, "(0.20, 0.10)")
    (goal,) = rolling.goals(1)
    assert is_goal(goal, 0.2, 0.1, 0.0)
    tool(page, "Go").tap()
    page.mouse.move(*at(page, 0.2, 0.1))
    page.mouse.down()
    page.keyboard.press("Escape")
    page.mouse.up()
    expect(tool(page, "Move view")).to_have_attribute("aria-pressed", "true")
    assert len(rolling.goals()) == 1


@pytest.mark.soak
def test_two_fingers_and_the_wheel_zoom_and_send_no_goal(open_page: Callable[..., Page], rolling: FakeGateway) -> None:
    page = open_page(page_name="map", has_touch=True)
    expect(page.get_by_text("Robot: x 1.00")).to_be_visible()
    tool(page, "Go").tap()
    narrow, wide = ([at(page, MIDDLE[0] + side * half, MIDDLE[1]) for side in (-1, 1)] for half in (0.25, 0.375))
    move_fingers(page, narrow, wide)
    page.mouse.move(*at(page, *MIDDLE))
    page.mouse.wheel(0, -math.log(1.2) / math.log(1.0015))
    drag(page, at(page, 0.3, 0.1, 1.8 * SCALE), at(page, 0.3, 0.0, 1.8 * SCALE))
    expect_drive(page, "(0.30, 0.10)")
    (goal,) = rolling.goals(1)
    assert is_goal(goal, 0.3, 0.1, -math.pi / 2)


def test_a_grid_is_drawn_where_its_origin_and_its_frame_put_it(
    open_page: Callable[..., Page], rolling: FakeGateway
) -> None:
    """Cells of 0.1 m from (0.3, 0.1), turned by 90 degrees: its x is along y, its y against x."""
    info = {"width": 3, "height": 2, "resolution": 0.1, "origin": pose(0.3, 0.1, math.pi / 2)}
    rolling.latched["/map"] = {"header": {"frame_id": "map"}, "info": info, "data": [100, 0, -1, 0, 50, 100]}
    page = open_page(page_name="map")
    ground, free, occupied = [0, 0, 0, 0], [255, 255, 255, 255], [57, 66, 77, 255]
    wait_for_colour(page, 0.25, 0.15, occupied)
    wait_for_colour(page, 0.25, 0.25, free)
    wait_for_colour(page, 0.25, 0.35, ground)
    wait_for_colour(page, 0.15, 0.15, free)
    wait_for_colour(page, 0.15, 0.25, [156, 160, 166, 255])
    wait_for_colour(page, 0.15, 0.35, occupied)
    wait_for_colour(page, 0.35, 0.15, ground)
    page.get_by_role("button", name="/map Obstacles").click()
    wait_for_colour(page, 0.25, 0.15, ground)


def test_a_path_and_a_scan_are_drawn_in_their_frames(open_page: Callable[..., Page], rolling: FakeGateway) -> None:
    poses = [{"pose": pose(x, 0.0, 0.0)} for x in (0.0, 0.35)]
    rolling.latched["/plan"] = {"header": {"frame_id": "odom"}, "poses": poses}
    beams = {"angle_min": 0.0, "angle_increment": math.pi / 2, "range_min": 0.0, "range_max": 9.0}
    rolling.latched["/scan"] = {"header": {"frame_id": "base_footprint"}, **beams, "ranges": [None, 0.6]}
    page = open_page(page_name="map")
    wait_for_colour(page, 0.4, 0.5, [179, 22, 28, 255])
    wait_for_colour(page, 1.0, 0.25, [20, 113, 58, 255])


@pytest.mark.soak
def test_zones_are_hatched_and_the_world_is_outlined_if_wanted(
    open_page: Callable[..., Page], rolling: FakeGateway
) -> None:
    """A red zone above the dock, and a box of 0.2 m that has gone from x = 0.2 to 0.6 since robot time 0."""
    header, colour = {"frame_id": "map"}, {"r": 1.0, "g": 0.0, "b": 0.0, "a": 1.0}
    corners = [moved(*at) for at in ((-0.1, 0.3), (0.1, 0.3), (0.1, 0.6), (-0.1, 0.6), (-0.1, 0.3))]
    zone = {"header": header, "action": 0, "type": 4, "pose": pose(0.0, 0.0, 0.0), "points": corners, "color": colour}
    rolling.latched["/zone_markers"] = {"markers": [zone]}
    box = {"name": "box", "kind": "box", "size": [0.2, 0.2, 1.0], "x": 0.2, "y": 0.1, "z": 0.0, "heading": 0.0}
    path = {"times": [0.0, 8.0], "xs": [0.2, 1.0], "ys": [0.1, 0.1], "repeats": False, "colour": ""}
    stamped = {"stamp": {"sec": 100, "nanosec": 0}, **header}
    rolling.latched["/world"] = {
        "map": {"header": stamped, "info": {}, "data": []},
        "shapes": [box | path],
        "time": 1.0,
    }
    types = TYPES | {"/zone_markers": "visualization_msgs/msg/MarkerArray", "/world": "rbxcompose_msgs/msg/World"}
    rolling.answers["/rosapi/topics"] = lambda _: {"topics": list(types), "types": list(types.values())}
    page = open_page(page_name="map")
    wait_for_colour(page, 0.1, 0.45, [255, 0, 0, 255])
    later = transform("odom", "laser", 0.0, 0.0, 0.0)
    later["header"]["stamp"] = {"sec": 103, "nanosec": 0}  # 4 s of robot time
    rolling.say("/tf", {"transforms": [later]})
    page.wait_for_function(f"([x, y]) => ({_PIXEL})([x, y])[3] > 0", arg=[*at(page, 0.7, 0.13)])
    world = page.get_by_role("button", name="/world World")
    world.click()
    expect(world).to_have_attribute("aria-pressed", "false")
    page.reload()
    expect(world).to_have_attribute("aria-pressed", "false")
    wait_for_colour(page, 0.1, 0.45, [255, 0, 0, 255])
    wait_for_colour(page, 0.7, 0.13, [0, 0, 0, 0])


@pytest.mark.soak
def test_a_goal_is_canceled_after_the_page_was_loaded_again(
    open_page: Callable[..., Page], rolling: FakeGateway
) -> None:
    goal = {"goal_info": {"goal_id": {"uuid": "AAECAw=="}}, "status": 2}
    cancels = "/go_to/_action/cancel_goal"
    rolling.answers[cancels] = lambda _: {"return_code": 0}
    page = open_page(page_name="map")
    page.get_by_role("button", name="Go to Dock").click()
    expect_drive(page, "Dock")
    rolling.say("/go_to/_action/status", {"status_list": [goal]})
    rolling.latched["/go_to/_action/status"] = {"status_list": [goal]}
    expect(state(page)).to_have_text("Driving to Dock")
    page.wait_for_function("localStorage.length > 0")
    page.reload()
    expect(state(page)).to_have_text("Driving to Dock")
    page.get_by_role("button", name="Cancel").click()
    rolling.say("/go_to/_action/status", {"status_list": [{**goal, "status": 5}]})
    expect(state(page)).to_have_text("Canceled on the way to Dock")
    (call,) = rolling.calls(cancels, 1)
    assert call["goal_info"]["goal_id"] == goal["goal_info"]["goal_id"]  # type: ignore[index]


def test_places_are_the_way_without_the_canvas(open_page: Callable[..., Page], rolling: FakeGateway) -> None:
    page = open_page(page_name="map")
    places = page.get_by_label("Places")
    expect(places.get_by_role("listitem")).to_have_count(2)
    expect(places.get_by_role("listitem").first).to_contain_text("Dock: it charges here")
    expect(places.get_by_role("listitem").last).to_contain_text("x 1.00\u202fm, y 0.50\u202fm, heading 90°")
    page.get_by_role("button", name="Go to Window seat").press("Enter")
    expect_drive(page, "Window seat")
    (goal,) = rolling.goals(1)
    assert is_goal(goal, 1.0, 0.5, math.pi / 2)
    rolling.act("action_feedback", goal, {"distance_remaining": 1.25})
    expect(page.get_by_text("1.25\u202fm to go")).to_be_visible()
    page.get_by_role("link", name="Mission").click()
    page.get_by_role("link", name="Map").click()
    page.get_by_role("button", name="Cancel").click()
    expect(state(page)).to_have_text("Canceled on the way to Window seat")
    page.get_by_text("Another pose").click()
    page.get_by_label("x [m]").fill("0.25")
    page.get_by_label("heading [°]").fill("45")
    page.get_by_role("button", name="Go", exact=True).last.click()
    expect_drive(page, "(0.25, 0.00)")
    assert is_goal(rolling.goals(2)[1], 0.25, 0.0, math.pi / 4)
    rolling.act("action_result", rolling.goals(2)[1], {}, status=4, result=True)
    expect(state(page)).to_have_text("Arrived at (0.25, 0.00)")


@pytest.mark.soak
def test_why_the_robot_does_not_go_is_said(open_page: Callable[..., Page], rolling: FakeGateway) -> None:
    def refuse(_: dict[str, Any]) -> None:
        raise Refused("the goal is too far away")

    answer, rolling.answers["/go_to"] = rolling.answers["/go_to"], refuse
    page = open_page(page_name="map")
    go = page.get_by_role("button", name="Go to Dock")
    go.click()
    expect(state(page)).to_have_text("Refused to drive to Dock: the goal is too far away")
    rolling.answers["/go_to"] = answer
    go.click()
    expect_drive(page, "Dock")
    rolling.act("action_result", rolling.goals()[-1], {"error_msg": "stuck"}, status=6, result=True)
    expect(state(page)).to_have_text("Gave up on the way to Dock: stuck")
    rolling.show("robot/RobotStatus", {"stop": {"by": "Ada", "time": 1.0}})
    expect(go).to_be_disabled()
    expect(tool(page, "Go")).to_be_disabled()
    rolling.show("robot/RobotStatus", {"stop": None})
    go.click()
    rolling.drop()
    expect(state(page)).to_contain_text("whether the robot still drives to Dock, or has arrived, is unknown")


@pytest.mark.soak
def test_a_running_mission_whose_goal_would_be_replaced_is_named(
    open_page: Callable[..., Page], rolling: FakeGateway
) -> None:
    page = open_page(page_name="map")
    rolling.show("mission/ListMissions", [{"name": "patrol", "state": "running", "claims": ["base"]}])
    expect(page.get_by_label("Goal")).to_contain_text("Mission Patrol is running")


def test_the_robot_is_told_where_it_is_if_something_listens(
    open_page: Callable[..., Page], rolling: FakeGateway
) -> None:
    page = open_page(page_name="map")
    expect(page.get_by_text("Robot: x 1.00")).to_be_visible()
    expect(tool(page, "Initial pose")).to_be_hidden()
    rolling.answers["/rosapi/subscribers"] = lambda asked: {"subscribers": ["/amcl"]}
    tool(page, "Initial pose").click()
    drag(page, at(page, 0.2, 0.1), at(page, 0.2, 0.6))
    expect(page.get_by_text("The robot was told that it is at (0.20, 0.10)")).to_be_visible()
    page.get_by_role("button", name="Go to Dock").click()
    expect_drive(page, "Dock")
    (told,) = [frame for _, frame in rolling.frames if frame["op"] == "publish"]
    assert (told["topic"], told["msg"]["header"]["frame_id"]) == ("/initialpose", "map")
    assert told["msg"]["pose"]["pose"]["position"] == pytest.approx(moved(0.2, 0.1), abs=1 / SCALE)
    assert told["msg"]["pose"]["pose"]["orientation"] == pytest.approx(turned(math.pi / 2), abs=0.01)
    assert len(told["msg"]["pose"]["covariance"]) == 36
    assert len(rolling.goals()) == 1
    info = {"width": 2, "height": 2, "resolution": 1.0, "origin": pose(-0.5, -0.5, 0.0)}
    rolling.say("/map", {"header": {"frame_id": "map"}, "info": info, "data": [0, 0, 0, 0]})
    wait_for_colour(page, 0.4, 0.4, [255, 255, 255, 255])
    page.get_by_text("Another pose").click()
    page.get_by_label("x [m]").fill("1.6")
    page.get_by_role("button", name="Set initial pose").click()
    expect(page.get_by_text("(1.60, 0.00) is outside of the map: nothing was sent")).to_be_visible()
    page.get_by_label("x [m]").fill("1.4")
    page.get_by_role("button", name="Set initial pose").click()
    expect(page.get_by_text("The robot was told that it is at (1.40, 0.00)")).to_be_visible()
    assert len([frame for _, frame in rolling.frames if frame["op"] == "publish"]) == 2


def test_the_view_has_room_for_a_goal_only_while_it_goes_there(
    open_page: Callable[..., Page], rolling: FakeGateway
) -> None:
    page = open_page(page_name="map")
    page.get_by_text("Another pose").click()
    page.get_by_label("x [m]").fill("50")
    page.get_by_role("button", name="Go", exact=True).last.click()
    expect_drive(page, "(50.00, 0.00)")
    rolling.act("action_result", rolling.goals(1)[0], {"error_msg": "outside"}, status=6, result=True)
    expect(state(page)).to_contain_text("Gave up")
    page.evaluate("new Promise(then => requestAnimationFrame(() => requestAnimationFrame(then)))")
    tool(page, "Go").click()
    drag(page, at(page, 0.2, 0.1), at(page, 0.2, 0.6))
    expect_drive(page, "(0.20, 0.10)")
    assert is_goal(rolling.goals(2)[1], 0.2, 0.1, math.pi / 2)


@pytest.mark.soak
def test_a_distance_is_measured(open_page: Callable[..., Page], rolling: FakeGateway) -> None:
    page = open_page(page_name="map")
    tool(page, "Measure").click()
    drag(page, at(page, 0.0, 0.0), at(page, 0.3, 0.4))
    expect(page.locator(".map-hint")).to_have_text("0.50\u202fm")


@pytest.mark.soak
def test_what_is_not_known_is_said(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    gateway.windows["robot/DescribeRobot"] = [CHARGER]
    page = open_page(page_name="map")
    expect(page.get_by_text("Where the robot is, is not known yet")).to_be_visible()
    expect(page.get_by_text("This robot has no places.")).to_be_visible()
    expect(page.get_by_text("This robot has no skill that drives to a pose.")).to_be_visible()
    expect(tool(page, "Go")).to_be_hidden()
    assert violations(page) == []
    gateway.is_away = True
    gateway.drop()
    expect(page.get_by_text("Where the robot is, is not known: there is no connection.")).to_be_visible()


def test_an_old_position_is_said_to_be_old(open_page: Callable[..., Page], rolling: FakeGateway) -> None:
    page = open_page(page_name="map")
    expect(page.get_by_text("Robot: x 1.00")).to_be_visible()
    odometry, rolling.repeated = rolling.repeated, {}
    expect(page.get_by_text(re.compile(r"Robot, as it was \d+\W+s ago: x 1\.00"))).to_be_visible()
    rolling.is_away = True
    rolling.drop()
    expect(page.get_by_text("Robot, as it was before")).to_be_visible()
    expect(page.get_by_role("button", name="Go to Dock")).to_be_disabled()
    rolling.is_away, rolling.repeated = False, odometry
    expect(page.get_by_text("Robot: x 1.00")).to_be_visible()
    expect(page.get_by_role("button", name="Go to Dock")).to_be_enabled()


@pytest.mark.soak
def test_places_are_not_drawn_without_a_way_to_map(open_page: Callable[..., Page], rolling: FakeGateway) -> None:
    del rolling.latched["/tf_static"]
    page = open_page(page_name="map")
    expect(page.get_by_text("in odom")).to_be_visible()
    expect(page.get_by_text("they are not drawn")).to_be_visible()


@pytest.mark.soak  # the editor of missions and the page that drives are looked at
def test_it_fits_the_window_and_the_finger(open_page: Callable[..., Page], rolling: FakeGateway) -> None:
    page = open_page(page_name="map")
    page.get_by_text("Another pose").click()
    page.get_by_role("button", name="Go to Dock").click()
    expect(page.get_by_role("button", name="/scan Laser: red dots")).to_be_visible()
    for size in (WIDE, PHONE):
        page.set_viewport_size(size)
        expect_fit(page)


def give_camera(gateway: FakeGateway, **more: Any) -> None:
    """Give the robot a camera of 640 x 480 pixels, which sees a tag of 50 x 50 in the middle."""
    gateway.config = CONFIG | {"camera": "/camera/image_raw"} | more
    drawn = io.BytesIO()
    PIL.Image.new("RGB", (64, 48)).save(drawn, "PNG")
    gateway.files["/stream"] = drawn.getvalue()
    things = "vision_msgs/msg/Detection3DArray"
    ports = [{"name": "seen", "kind": "out", "topic": "/tags", "type": things}]
    gateway.windows["robot/DescribeRobot"] = [component("tags", ports, {})]
    header = {"frame_id": "eye"}
    matrix = [500, 0, 320, 0, 500, 240, 0, 0, 1]
    gateway.latched["/camera/camera_info"] = {"header": header, "width": 640, "height": 480, "k": matrix}
    centre = {"position": {"x": 0.0, "y": 0.0, "z": 2.0}, "orientation": {"x": 1.0, "y": 0.0, "z": 0.0, "w": 0.0}}
    result = {"hypothesis": {"class_id": "left_box", "score": 0.9}}
    tag = {"id": "left_box", "results": [result], "bbox": {"center": centre, "size": {"x": 0.2, "y": 0.2, "z": 0.001}}}
    gateway.latched["/tags"] = {"header": header, "detections": [tag]}


@pytest.mark.parametrize("drive", [CONFIG["drive"], None])
def test_the_whole_picture_is_seen_and_what_is_found_is_where_it_is_in_that(
    open_page: Callable[..., Page], gateway: FakeGateway, drive: object
) -> None:
    give_camera(gateway, drive=drive)
    page = open_page(page_name="drive")
    picture = page.get_by_alt_text("What the robot's camera sees")
    expect(picture).to_have_css("object-fit", "contain")
    found = page.locator(".seen polygon").evaluate("element => JSON.stringify(element.getBoundingClientRect())")
    tag, around = json.loads(found), picture.bounding_box()
    assert around is not None
    assert around["width"] > around["height"] * 4 / 3  # beside the picture is nothing
    assert tag["height"] == pytest.approx(around["height"] * 50 / 480, abs=1)
    assert tag["width"] == pytest.approx(tag["height"], abs=1)
    assert tag["x"] + tag["width"] / 2 == pytest.approx(around["x"] + around["width"] / 2, abs=1)
    assert tag["y"] + tag["height"] / 2 == pytest.approx(around["y"] + around["height"] / 2, abs=1)


@pytest.mark.soak
def test_what_a_camera_sees_is_over_its_picture_until_it_is_old(
    open_page: Callable[..., Page], gateway: FakeGateway
) -> None:
    give_camera(gateway)
    page = open_page(page_name="drive")
    overlay = page.locator(".seen")
    expect(overlay).to_have_attribute("data-seen", "left box")
    expect(overlay.locator("polygon")).to_have_attribute("points", "295.0,215.0 345.0,215.0 345.0,265.0 295.0,265.0")
    expect(overlay).to_have_attribute("data-seen", "")
