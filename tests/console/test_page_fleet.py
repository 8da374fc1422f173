"""The page of a system's robots in a real browser."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import pi
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.console.browser import CHROMIUM
from tests.console.fake_gateway import RUNNING, FakeGateway
from tests.console.looks import PHONE, overflows, violations

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")


TYPES = {"/base/odom": "nav_msgs/msg/Odometry", "/tf": "tf2_msgs/msg/TFMessage"}


def odometry(x: float, z: float = 0.0) -> dict[str, Any]:
    pose = {"position": {"x": x, "y": 1.0, "z": 0.0}, "orientation": {"x": 0.0, "y": 0.0, "z": z, "w": 1.0}}
    return {"header": {"frame_id": "odom"}, "child_frame_id": "base_link", "pose": {"pose": pose}}


def says(gateway: FakeGateway, mission: str, x: float) -> None:
    gauge = {"topic": "/battery_level", "message": "std_msgs/Float32", "unit": "%"}
    gateway.windows[RUNNING] = {"stop": None, "batteries": {"main_battery": gauge}}
    gateway.windows["mission/ListMissions"] = [{"name": mission, "about": "", "state": "running", "claims": []}]
    gateway.latched["/diagnostics_toplevel_state"] = {"level": 0, "message": ""}
    gateway.answers["/rosapi/topics"] = lambda _: {"topics": list(TYPES), "types": list(TYPES.values())}
    gateway.latched["/base/odom"] = odometry(x)


@pytest.fixture
def fleet(gateway: FakeGateway) -> Iterator[FakeGateway]:
    """The gateway of another robot of the system."""
    other = FakeGateway(gateway.static)
    robots = {"turtlebot": f":{gateway.port}", "digger": f":{other.port}", "lost_one": ":9"}
    gateway.config = gateway.config | {"fleet": robots}
    says(gateway, "patrol", 0.0)
    says(other, "dig", 4.0)
    other.windows[RUNNING] |= {"stop": {"by": "the mushroom", "time": 3.0}}
    other.latched["/diagnostics_toplevel_state"] = {"level": 2, "message": "servo 3 is hot"}
    yield other
    other.close()


def test_robots_of_a_system_are_seen_at_once_and_one_opens_each(
    open_page: Callable[..., Page], gateway: FakeGateway, fleet: FakeGateway
) -> None:
    page = open_page(page_name="fleet", foreign=[fleet.url, "http://127.0.0.1:9/"])
    cards = {name: page.locator("article").filter(has_text=name) for name in ("Turtlebot", "Digger", "Lost one")}
    expect(cards["Turtlebot"]).to_contain_text("Patrol is running")
    expect(cards["Turtlebot"]).to_contain_text("OK")
    expect(cards["Turtlebot"].locator("battery-gauge")).to_contain_text("78%")
    expect(cards["Digger"]).to_contain_text("Dig is running")
    expect(cards["Digger"]).to_contain_text("Stopped by the mushroom")
    expect(cards["Digger"]).to_contain_text("Error: servo 3 is hot")
    expect(cards["Digger"].get_by_role("link", name="Open")).to_have_attribute("href", fleet.url)
    expect(cards["Lost one"]).to_contain_text("Does not answer")
    places = page.locator(".fleet-map")
    expect(places).to_contain_text("Digger at 4.00, 1.00 m in odom")
    fleet.say("/base/odom", odometry(2.0, pi))
    expect(places).to_contain_text("Digger at 2.00, 1.00 m in odom")
    turned = {"translation": {"x": 5.0, "y": 0.0, "z": 0.0}, "rotation": {"x": 0.0, "y": 0.0, "z": 1.0, "w": 0.0}}
    link = {"header": {"frame_id": "map"}, "child_frame_id": "odom", "transform": turned}
    fleet.say("/tf", {"transforms": [link]})
    expect(places).to_contain_text("Digger at 3.00, \u22121.00 m")
    expect(places).to_contain_text("Turtlebot at 0.00, 1.00 m in odom")
    assert violations(page) == []
    fleet.is_locked = True
    fleet.drop()
    expect(cards["Digger"]).to_contain_text("Nothing is known of it. Paste its link")
    expect(cards["Digger"]).not_to_contain_text("mission")
    for given in ("wrong", f"{fleet.url}#token=the-token"):
        expect(cards["Digger"]).to_contain_text("Nothing is known of it")
        cards["Digger"].get_by_label("Link of Digger").fill(given)
        cards["Digger"].get_by_role("button", name="Show").click()
    expect(cards["Digger"]).to_contain_text("Dig is running")
    fleet.is_locked = True
    page.reload()
    expect(cards["Digger"]).to_contain_text("Dig is running")  # the browser has kept the link


def test_the_map_is_empty_when_all_robots_are_gone(
    open_page: Callable[..., Page], gateway: FakeGateway, fleet: FakeGateway
) -> None:
    page = open_page(page_name="fleet", foreign=[fleet.url, "http://127.0.0.1:9/"])
    expect(page.locator(".fleet-map")).to_contain_text("Digger at 4.00")
    for robot in (gateway, fleet):
        robot.is_away = True
        robot.drop()
    expect(page.locator(".fleet-map")).to_have_text("Waiting for the first position\u2026")


def test_it_fits_a_phone(open_page: Callable[..., Page], fleet: FakeGateway) -> None:
    page = open_page(page_name="fleet", foreign=[fleet.url, "http://127.0.0.1:9/"], viewport=PHONE)
    expect(page.locator("article").first).to_be_visible()
    assert not overflows(page)
