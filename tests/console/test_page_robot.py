"""The page of the robot's components in a real browser."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.console.browser import CHROMIUM
from tests.console.fake_gateway import RUNNING, FakeGateway
from tests.console.looks import PHONE, expect_fit, violations
from tests.console.test_page import wait_for

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")

DESCRIBED = "robot/DescribeRobot"
_PORT = {"unit": "", "skill": "", "is_command": False, "claims": "", "is_pausable": False}
_HINTS: dict[str, dict[str, Any]] = {"measures": {}, "choices": {}, "outcomes": {}}


def port(name: str, kind: str, topic: str, type_: str, **more: Any) -> dict[str, Any]:
    return {"name": name, "kind": kind, "topic": topic, "type": type_, **_PORT, **_HINTS, **more}


def component(name: str, type_: str, *ports: dict[str, Any], **more: Any) -> dict[str, Any]:
    about = f"What a {type_} does."
    return {"name": name, "type": type_, "about": about, "process": "robot", "ports": list(ports)} | {
        "capabilities": {},
        "requests": {},
        **more,
    }


def state(name: str, **more: Any) -> dict[str, Any]:
    plain = {"state": "active", "process": "robot", "pid": 7, "restarts": 0, "waits_for": None, "note": ""}
    return {"name": name, **plain, **more}


STRANGER = component(
    "sprayer",
    "acme_sprayer",
    port("flow", "out", "/flow", "std_msgs/msg/Float32", unit="V"),
    port("spray", "serves_action", "/spray", "acme_msgs/action/Spray", skill="spray")
    | {"measures": {"angle": "rad", "amount": "0 to 1"}, "choices": {"nozzle": ["fine", "wide"]}},
    port("rinse", "serves", "/rinse", "std_srvs/srv/Trigger", skill="rinse"),
    port("set_level", "serves", "/set_level", "acme_msgs/srv/SetLevel", skill="set_level", unit="%"),
)
BASE = component(
    "base",
    "diff_drive_sim",
    port("cmd_vel", "in", "/cmd_vel", "geometry_msgs/msg/Twist", is_command=True),
    port("odom", "out", "/odom", "nav_msgs/msg/Odometry"),
    capabilities={"Drives": [{"commands": "cmd_vel", "odometry": "odom", "max_speed": 0.5, "max_turn_rate": 1.5}]},
)
MUX = component(
    "cmd_vel",
    "mux",
    port("output", "out", "/cmd_vel", "geometry_msgs/msg/Twist"),
    port("announced", "out", "/cmd_vel/active", "std_msgs/msg/String"),
    capabilities={"Forwards": [{"inputs": ["teleop"], "output": "output"}]},
    requests={"mux.LookAtMux": False},
)
MISSION = component(
    "mission",
    "mission",
    port("events", "out", "/mission/events", "std_msgs/msg/String"),
    port("level", "out", "/level", "diagnostic_msgs/msg/DiagnosticStatus"),
    port("sent", "out", "/sent", "geometry_msgs/msg/Twist"),
    port("wanted", "out", "/wanted", "sensor_msgs/msg/JointState"),
    requests={"mission.ListMissions": False},
)
ARM = component(
    "left_arm",
    "arm",
    port("move", "serves_action", "/left_arm/move", "rbxcompose_msgs/action/MoveArm", skill="move_left_arm")
    | {"choices": {"pose": ["resting", "wave"]}},
)
SERVOS = component(
    "servos",
    "servo_bus",
    port("joint_states", "out", "/joint_states", "sensor_msgs/msg/JointState"),
    port("pan_enable", "serves", "/pan/enable", "std_srvs/srv/SetBool", skill="enable_pan"),
    port("pan_relax", "serves", "/pan/relax", "std_srvs/srv/Trigger", skill="relax_pan"),
    port("slide_enable", "serves", "/slide/enable", "std_srvs/srv/SetBool", skill="enable_slide"),
    port("grip", "serves_action", "/hand/grip", "rbxcompose_msgs/action/Grip", skill="hand"),
    requests={"servo_bus.ListFaults": False, "servo_bus.InjectFault": True},
)


def definition(type_: str, **fields: str) -> dict[str, Any]:
    names, types = list(fields), list(fields.values())
    return {"type": type_, "fieldnames": names, "fieldtypes": types, "fieldarraylen": [-1] * len(names)}


LEVEL = definition("acme_msgs/SetLevel_Request", value="float32")
SPRAY = definition("acme_msgs/Spray_Goal", nozzle="string", angle="float64", amount="float64", dry="boolean")


def has_components(gateway: FakeGateway) -> None:
    gateway.windows[DESCRIBED] = [STRANGER, BASE, MUX, SERVOS, ARM, MISSION]
    gateway.windows[RUNNING] = {
        "stop": None,
        "components": [state("sprayer", state="failed", restarts=3, note="no water"), state("base"), state("cmd_vel")],
    }
    gateway.answers |= {
        "/rosapi/service_request_details": lambda _: {"typedefs": [LEVEL]},
        "/rosapi/action_goal_details": lambda _: {"typedefs": [SPRAY]},
        "/rinse": lambda _: {"success": False, "message": "no water"},
        "/set_level": lambda _: {"success": True, "message": "set"},
    }
    gateway.latched["/robot_description"] = {"data": "<robot><joint name='slide' type='prismatic'/></robot>"}
    gateway.latched["/odom"] = {"twist": {"twist": {"linear": {"x": 0.25}, "angular": {"z": 0}}}}
    gateway.latched["/cmd_vel/active"] = {"data": "teleop"}
    gateway.windows["mission/ListMissions"] = [
        {"name": "patrol", "state": "running"},
        {"name": "dock", "state": "idle"},
    ]
    gateway.latched["/mission/events"] = {"data": '{"event": "node"}'}
    gateway.latched["/level"] = {"level": 1, "name": "", "message": "low battery", "hardware_id": "", "values": []}
    gateway.latched["/sent"] = {"linear": {"x": 0.3, "y": 0.0}, "angular": {"z": 1.05}}
    gateway.latched["/wanted"] = {"name": ["pan", "tilt"], "position": [0.5, -0.25], "velocity": []}
    gateway.latched["/flow"] = {"data": 3.25}
    gateway.latched["/joint_states"] = {"name": ["pan", "slide"], "position": [0.7853981, 0.012]}


@pytest.fixture
def robot(gateway: FakeGateway) -> FakeGateway:
    has_components(gateway)
    return gateway


def test_a_component_that_nobody_knows_has_a_card_with_all_it_offers(
    open_page: Callable[..., Page], robot: FakeGateway
) -> None:
    page = open_page(page_name="robot")
    card = page.get_by_label("sprayer", exact=True)
    expect(card).to_contain_text("What a acme_sprayer does.")
    expect(card.get_by_role("status").first).to_have_text("Failed (no water)")
    expect(card).to_contain_text("3.3\u202fV")
    missions = page.get_by_label("mission", exact=True)
    for words in (
        "Patrol is running",
        "LevelWarning: low battery",
        "Sent angular z1.05\u202frad/s",
        "Wanted positionpan 0.50, tilt \u22120.25",
    ):
        expect(missions).to_contain_text(words)
    expect(missions).not_to_contain_text('"event"')
    card.get_by_role("button", name="Rinse").click()
    expect(card).to_contain_text("Failed: no water")
    card.get_by_text("Set level").click()
    card.get_by_label("Value").fill("120")
    card.get_by_role("button", name="Set level").click()
    expect(card).to_contain_text("value: at most 100")
    card.get_by_label("Value").fill("40")
    card.get_by_role("button", name="Set level").click()
    expect(card).to_contain_text("Done: set")
    assert robot.calls("/set_level") == [{"value": 40}]
    assert violations(page) == []


def test_a_goal_is_followed_and_canceled_after_another_page_was_looked_at(
    open_page: Callable[..., Page], robot: FakeGateway
) -> None:
    page = open_page(page_name="robot")
    card = page.get_by_label("sprayer", exact=True)
    card.get_by_text("Spray", exact=True).click()
    card.get_by_label("Angle").fill("10")
    card.get_by_label("Amount").fill("0.5")
    card.get_by_role("button", name="Spray").click()
    expect(card.get_by_role("button", name="Cancel spray")).to_be_visible()
    (goal,) = robot.goals(1)
    page.get_by_role("link", name="Log").click()
    expect(card).to_have_count(0)
    robot.act("action_feedback", goal, {"left": 3})
    page.get_by_role("link", name="Robot").click()
    expect(card).to_contain_text("left 3")
    robot.act("action_feedback", goal, {"left": 2})
    expect(card).to_contain_text("left 2")
    card.get_by_role("button", name="Cancel spray").click()
    expect(card).to_contain_text("Canceled")
    expect(card.get_by_role("button", name="Spray", exact=True)).to_be_visible()


@pytest.mark.soak  # further cards are tested here
def test_cards_of_what_is_known_show_what_matters(open_page: Callable[..., Page], robot: FakeGateway) -> None:
    page = open_page(page_name="robot")
    servos = page.get_by_label("servos", exact=True)
    expect(servos.get_by_role("row", name="Pan")).to_contain_text("45\u202f\u00b0")
    expect(servos.get_by_role("row", name="Slide")).to_contain_text("12\u202fmm")
    servos.get_by_role("button", name="Relax pan").click()
    expect(servos).to_contain_text("Pan: relaxed")
    assert robot.calls("/pan/relax") == [{}]
    robot.answers["/pan/enable"] = lambda _: {"success": False, "message": "it was too hot and rests for 49 s"}
    servos.get_by_role("button", name="Enable pan").click()
    expect(servos).to_contain_text("Pan: not enabled: it was too hot and rests for 49 s")
    robot.repeated = {"/joint_states": {"name": ["pan"], "position": [0.7853981]}}
    expect(servos.get_by_role("row", name="Slide")).to_contain_text("\u2013")
    expect(servos.get_by_role("row", name="Pan")).to_contain_text("45\u202f\u00b0")
    expect(page.get_by_label("base", exact=True)).to_contain_text("0.25\u202fm/s of 0.50\u202fm/s")


@pytest.mark.soak
def test_arms_go_to_their_poses_grippers_open_and_a_mux_names_who_commands(
    open_page: Callable[..., Page], robot: FakeGateway
) -> None:
    robot.answers |= {"/left_arm/move": lambda _: {"outcome": "success"}, "/hand/grip": lambda _: {"opening": 0.02}}
    page = open_page(page_name="robot")
    page.get_by_label("left_arm", exact=True).get_by_role("button", name="Wave").click()
    expect(page.get_by_label("left_arm", exact=True)).to_contain_text("outcome success")
    hand = page.get_by_label("servos", exact=True)
    hand.get_by_label("Hand").fill("")
    hand.get_by_role("button", name="Open").click()
    expect(hand).to_contain_text("The opening is no number.")
    hand.get_by_label("Hand").fill("20")
    hand.get_by_role("button", name="Open").click()
    expect(hand).to_contain_text("opening 0.02")
    assert [goal["args"] for _, goal in robot.frames if goal["op"] == "send_action_goal"] == [
        {"pose": "wave"},
        {"opening": 0.02},
    ]
    expect(page.get_by_label("cmd_vel", exact=True)).to_contain_text("Teleop")


@pytest.mark.soak
def test_a_fault_of_a_simulated_servo_is_simulated(open_page: Callable[..., Page], robot: FakeGateway) -> None:
    robot.answers |= {
        "servo_bus.ListFaults": lambda _: {"jam": "does not turn", "overheat": "is as hot as it may be"},
        "servo_bus.InjectFault": lambda _: "overheat of slide for 5 s",
    }
    servos = open_page(page_name="robot").get_by_label("servos", exact=True)
    servos.get_by_text("Simulate a fault").click()
    servos.get_by_label("Joint", exact=True).select_option("slide")
    servos.get_by_label("Fault", exact=True).select_option("overheat")
    servos.get_by_label("For how long, s").fill("5")
    servos.get_by_role("button", name="Simulate it").click()
    expect(servos).to_contain_text("overheat of slide for 5 s")
    (asked,) = robot.asked("servo_bus.InjectFault", 1)
    assert (asked["joint"], asked["fault"], asked["lasts"]) == ("slide", "overheat", 5)


def test_it_is_seen_how_components_are_wired_and_which_processes_run_them(
    open_page: Callable[..., Page], robot: FakeGateway
) -> None:
    page = open_page(page_name="robot")
    page.get_by_role("button", name="Wiring").click()
    expect(page.get_by_role("img", name="cmd_vel to base: /cmd_vel")).to_be_visible()
    assert violations(page) == []
    page.get_by_role("button", name="Processes").click()
    row = page.get_by_role("row", name="sprayer")
    expect(row).to_contain_text("Failed (no water)")
    expect(row).to_contain_text("3")
    page.get_by_label("Find a component").fill("spray")
    expect(page.get_by_role("row", name="base")).to_be_hidden()
    expect(row).to_be_visible()


@pytest.mark.soak
def test_a_long_status_leaves_the_name_on_its_line(open_page: Callable[..., Page], robot: FakeGateway) -> None:
    words = "head_pan_joint: it was too hot and rests for 49 s, then until 45 degC: it has 80 degC"
    robot.windows[RUNNING] = {"stop": None, "components": [state("servos", state="failed", note=words)]}
    page = open_page(page_name="robot")
    card = page.get_by_label("servos", exact=True)
    expect(card.get_by_role("status").first).to_contain_text(words)
    heights = [heading.bounding_box() for heading in page.locator(".component h2").all()]
    assert len({round(box["height"]) for box in heights if box}) == 1


@pytest.mark.soak  # as the Drive page does, of the same parts
def test_it_fits_a_phone(open_page: Callable[..., Page], robot: FakeGateway) -> None:
    page = open_page(page_name="robot", viewport=PHONE, has_touch=True)
    expect(page.get_by_label("sprayer", exact=True)).to_be_visible()
    page.get_by_text("Spray", exact=True).first.click()
    expect(page.get_by_label("Nozzle")).to_be_visible()
    expect_fit(page)


def test_without_an_answer_it_says_why(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    page = open_page(page_name="robot")
    expect(page.get_by_text("Asking the robot what it is made of")).to_be_visible()
    window = f"/console/windows/{DESCRIBED}"
    wait_for(lambda: any(window in topics for topics in list(gateway.subscribed.values())), page)
    gateway.say(window, {"refused": "the supervisor does not answer"})
    expect(page.get_by_text("the supervisor does not answer")).to_be_visible()
