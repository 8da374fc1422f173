"""The pages of data, muxes and the log in a real browser."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from rbxcompose.base.requests import Refused
from tests.console.browser import CHROMIUM
from tests.console.fake_gateway import CONFIG, FakeGateway, FakeLog
from tests.console.looks import PHONE, expect_fit, overflows, violations
from tests.console.test_page_robot import DESCRIBED, component, port
from tests.soak import rare

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")

TOPICS = {"/scan": "sensor_msgs/msg/LaserScan", "/pose": "geometry_msgs/msg/Pose2D"}
POSE = {"x": 1.5, "y": None, "name": "", "flags": [True, False]}
LOOK_AT = "mux/LookAtMux/component/cmd_vel"


def has_topics(gateway: FakeGateway) -> None:
    gateway.answers["/rosapi/topics"] = lambda _: {"topics": list(TOPICS), "types": list(TOPICS.values())}
    gateway.latched["/pose"] = POSE


def test_a_topic_shows_its_messages_and_a_number_is_plotted(
    open_page: Callable[..., Page], gateway: FakeGateway
) -> None:
    has_topics(gateway)
    rates = {"/scan": 9.96, "/pose": 50.2}
    gateway.answers["/console/rates"] = lambda _: {"success": True, "message": "", "answer": rates}
    page = open_page(page_name="data")
    expect(page.get_by_role("button", name="/scan")).to_contain_text("10.0\u202fHz")
    page.get_by_label("Find a topic").fill("pos")
    expect(page.get_by_role("button", name="/scan")).to_be_hidden()
    page.get_by_role("button", name="/pose").click()
    messages = page.get_by_label("Messages of /pose")
    expect(messages.get_by_role("button", name="y not a number, plot")).to_be_visible()
    expect(messages).to_contain_text("name: (empty)")
    messages.get_by_text("flags (2)").click()
    expect(messages.get_by_role("button", name="flags 0 true, plot")).to_be_visible()
    messages.get_by_role("button", name="x 1.5, plot").click()
    expect(page.get_by_role("button", name="Remove /pose x")).to_be_visible()
    for x in (2.0, 3.0):
        gateway.say("/pose", POSE | {"x": x})
    expect(page.locator(".plot-host")).to_have_attribute("data-points", re.compile("^[2-9]"))
    expect(messages.get_by_role("button", name="x 3, plot")).to_be_visible()
    assert violations(page) == []
    expect(page.locator(".plot-host .u-over")).to_have_css("left", "60px")  # beside it, the labels of the axis
    gateway.say("/pose", POSE | {"x": 3e9})
    expect(page.locator(".plot-host .u-over")).not_to_have_css("left", "60px")
    gateway.say("/pose", POSE | {"x": 3.0})
    expect(messages.get_by_role("button", name="x 3, plot")).to_be_visible()
    if (shots := os.environ.get("SHOTS")) is not None:
        page.screenshot(path=f"{shots}/data.png", full_page=True)
    page.get_by_role("link", name="Log").click()
    expect(messages).to_be_hidden()
    gateway.latched["/pose"] = POSE | {"x": 3.0}
    page.get_by_role("link", name="Data").click()
    expect(page.get_by_role("button", name="Remove /pose x")).to_be_visible()
    expect(messages.get_by_role("button", name="x 3, plot")).to_be_visible()
    messages.get_by_role("button", name="Pause").click()
    gateway.say("/pose", POSE | {"x": 4.0})
    page.get_by_role("button", name="Remove /pose x").click()
    expect(page.get_by_label("Plot", exact=True)).to_be_hidden()
    expect(messages.get_by_role("button", name="x 3, plot")).to_be_visible()


def test_a_message_is_published_and_what_is_wrong_is_said(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    has_topics(gateway)
    page = open_page(page_name="data")
    page.get_by_role("button", name="/pose").click()
    page.get_by_text("Publish", exact=True).click()
    text = page.get_by_label("A message for /pose")
    expect(text).to_have_value(json.dumps(POSE, indent=2))
    text.fill("{x: 1}")
    page.get_by_role("button", name="Publish once").click()
    expect(page.get_by_text("This is no JSON")).to_be_visible()
    text.fill('{"x": 7}')
    page.get_by_role("button", name="Publish once").click()
    expect(page.get_by_text("Published.")).to_be_visible()
    (published,) = [frame for _, frame in gateway.frames if frame["op"] == "publish"]
    assert (published["topic"], published["msg"], published["type"]) == ("/pose", {"x": 7}, TOPICS["/pose"])
    page.get_by_label("Hz").fill("1000")
    page.get_by_role("button", name="Publish again and again").click()
    expect(page.get_by_text("a number up to 50 Hz")).to_be_visible()
    gateway.others = "Ada"
    text.fill('{"linear": {"x": 1}}')
    page.get_by_label("Hz").fill("50")
    page.get_by_role("button", name="Publish again and again").click()
    expect(page.get_by_text("not yours")).to_be_visible()
    expect(page.get_by_role("button", name="Publish again and again")).to_be_visible()


def an_input(name: str, priority: int, state: str, **more: Any) -> dict[str, Any]:
    plain = {"topic": f"/cmd_vel/{name}", "why": "", "until": None, "silent_for": 0.1}
    return {"name": name, "priority": priority, "state": state, **plain, **more}


def a_mux(holder: str, mode: str = "priority", **states: str) -> dict[str, Any]:
    inputs = [an_input(name, 100 - 10 * turn, state) for turn, (name, state) in enumerate(states.items())]
    about = {"output": "/cmd_vel", "mode": mode, "why": f"{holder} holds", "selected": holder}
    return {"name": "cmd_vel", "holder": holder, "inputs": inputs, "locks": [], **about}


def has_mux(gateway: FakeGateway) -> None:
    gateway.windows[DESCRIBED] = [component("cmd_vel", "mux", requests={"mux.LookAtMux": False})]
    gateway.windows[LOOK_AT] = a_mux("navigation", teleop="silent", navigation="holds")


def test_it_is_seen_who_commands_and_an_input_is_locked(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    has_mux(gateway)

    def lock(request: dict[str, Any]) -> str:
        gateway.show(LOOK_AT, a_mux("teleop", teleop="holds", navigation="locked"))
        return f"locked {request['inputs'][0]}"

    gateway.answers["mux.LockMuxInputs"] = lock
    page = open_page(page_name="mux")
    mux = page.get_by_label("cmd_vel", exact=True)
    expect(mux.get_by_role("status")).to_have_text("Navigation commands")
    expect(mux.get_by_role("row", name="teleop")).to_contain_text("Silent")
    mux.get_by_role("button", name="Lock navigation").click()
    expect(page.get_by_text("locked navigation")).to_be_visible()
    expect(mux.get_by_role("status")).to_have_text("Teleop commands")
    expect(mux.get_by_role("button", name="Unlock navigation")).to_be_visible()
    assert violations(page) == []
    page.set_viewport_size({"width": 320, "height": 568})
    assert not overflows(page)


@pytest.mark.soak  # as one is locked
def test_an_input_is_selected_where_inputs_are(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    has_mux(gateway)
    gateway.windows[LOOK_AT] = a_mux("a", mode="select", a="holds", b="waits")

    def refuse(_: dict[str, Any]) -> str:
        raise Refused("b must rest first")

    gateway.answers["mux.SelectMuxInput"] = refuse
    page = open_page(page_name="mux")
    expect(page.get_by_role("button", name="Select a", exact=True)).to_be_disabled()
    page.get_by_role("button", name="Select b").click()
    expect(page.get_by_text("b must rest first")).to_be_visible()
    assert gateway.asked("mux.SelectMuxInput") == [{"component": "cmd_vel", "type": "mux.SelectMuxInput", "input": "b"}]


def test_who_may_only_look_is_offered_nothing_that_the_robot_refuses(
    open_page: Callable[..., Page], gateway: FakeGateway
) -> None:
    has_mux(gateway)
    has_topics(gateway)
    rinse = port("rinse", "serves", "/rinse", "std_srvs/srv/Trigger", skill="rinse")
    navigate = port("go_to", "serves_action", "/go_to", "nav2_msgs/action/NavigateToPose")
    gateway.windows[DESCRIBED] = [
        component("cmd_vel", "mux", rinse, requests={"mux.LookAtMux": False}),
        component("go_to", "navigator", navigate),
    ]
    item = {
        "path": "/arm/elbow",
        "name": "elbow",
        "depth": 1,
        "level": 2,
        "message": "hot",
        "is_group": False,
        "values": [],
    }
    group = item | {"path": "/arm", "name": "arm", "depth": 0, "is_group": True}
    gateway.windows["diagnostics/ShowDiagnostics"] = {"time": 1.0, "level": 2, "cause": "hot", "lines": [group, item]}
    gateway.config = {**CONFIG, "role": "view", "places": {"dock": {"x": 0.0, "y": 0.0, "heading": 0.0}}}
    gateway.windows["robot/RobotStatus"] = {"stop": {"by": "the console", "time": 1.0}}
    page = open_page(page_name="mux")

    def expect_refused(*names: str) -> None:
        for name in names:
            button = page.get_by_role("button", name=name, exact=True)
            expect(button).to_be_disabled()
            expect(button).to_have_attribute("title", "This needs the link of the role operate.")

    expect_refused("Lock navigation", "Lock all", "Unlock all", "Release")
    expect(page.get_by_text("Nothing moves until somebody with the role operate presses Release.")).to_be_visible()
    page.get_by_role("link", name="Drive").click()
    expect(page.locator(".hint").first).to_have_text("Driving needs the link of the role operate.")
    expect(page.get_by_label("Top speed")).to_be_disabled()
    expect(page.get_by_label("Driver", exact=True)).to_contain_text("Nobody is driving")
    page.keyboard.press("Shift+ArrowUp")
    assert {frame["op"] for _, frame in gateway.frames} == {"subscribe", "unsubscribe"}
    assert violations(page) == []
    page.get_by_role("link", name="Robot").click()
    expect_refused("Rinse")
    page.get_by_role("link", name="Data").click()
    page.get_by_role("button", name="/pose").click()
    page.get_by_text("Publish", exact=True).click()
    expect_refused("Publish once", "Publish again and again")
    page.get_by_role("link", name="Map").click()
    expect_refused("Go to Dock")
    page.get_by_role("link", name="Diagnostics").click()
    page.locator(".levels").get_by_role("button", name="arm").last.click()
    expect_refused("Acknowledge", "Acknowledge this group")


def test_the_log_grows_and_is_filtered(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    log = FakeLog(gateway)
    page = open_page(page_name="log")
    lines = page.get_by_role("listitem")
    expect(lines).to_have_count(2)
    expect(lines.first).to_contain_text("Warning")
    log.add("error", "base", "no odometry")
    expect(lines.first).to_contain_text("no odometry")
    page.get_by_label("Level").select_option("Warnings and errors")
    expect(lines).to_have_count(2)
    page.get_by_label("Component").select_option("battery")
    expect(lines).to_have_count(1)
    page.get_by_text("Details").click()
    expect(page.get_by_text("at 12 V")).to_be_visible()
    page.get_by_label("Find in the log").fill("corner")
    expect(lines).to_have_count(0)
    with page.expect_download() as download:
        page.get_by_label("Find in the log").fill("")
        page.get_by_role("button", name="Download").click()
    assert download.value.suggested_filename == "turtlebot.log"
    assert violations(page) == []


@pytest.mark.soak
def test_what_check_found_stands_above_the_log(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    place = {"file": "robot.yaml", "line": 7, "column": 3}
    said = {"code": "RBX3141", "severity": "warning", "message": "joystick below navigation", "help": "raise it"}
    FakeLog(gateway).findings = [{**place, **said}]
    page = open_page(page_name="log")
    page.get_by_text("1 finding of check").click()
    expect(page.get_by_label("Findings of check")).to_contain_text("robot.yaml:7:3 RBX3141")
    assert violations(page) == []


@pytest.mark.parametrize("name", ["data", *rare("mux", "log")])
@pytest.mark.soak  # as the Drive page does, of the same parts
def test_they_fit_a_phone(open_page: Callable[..., Page], gateway: FakeGateway, name: str) -> None:
    has_topics(gateway)
    has_mux(gateway)
    FakeLog(gateway)
    page = open_page(page_name=name, viewport=PHONE, has_touch=True)
    ready = {"data": "/pose", "mux": "Lock all", "log": "Pause"}[name]
    page.get_by_role("button", name=ready).first.click()
    page.wait_for_load_state()
    assert page.evaluate(
        "[...document.querySelectorAll('.mux .wide')].every(box => box.scrollWidth <= box.clientWidth)"
    )
    expect_fit(page)


@pytest.mark.soak
def test_what_is_not_there_is_said(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    gateway.windows[DESCRIBED] = [component("base", "diff_drive_sim")]
    gateway.answers["/rosapi/topics"] = lambda _: {"topics": [], "types": []}
    page = open_page(page_name="mux")
    expect(page.get_by_text("This robot has no mux.")).to_be_visible()
    page.get_by_role("link", name="Data").click()
    expect(page.get_by_text("Nothing publishes or listens.")).to_be_visible()
