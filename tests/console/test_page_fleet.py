"""The page of a system's robots in a real browser."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import pi

import pytest
from playwright.sync_api import Page, expect

from tests.console.browser import CHROMIUM
from tests.console.fake_gateway import RUNNING, FakeGateway
from tests.console.looks import PHONE, overflows, violations

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")


def says(gateway: FakeGateway, mission: str, x: float) -> None:
    gauge = {"topic": "/battery_level", "message": "std_msgs/Float32", "unit": "%"}
    gateway.windows[RUNNING] = {"stop": None, "batteries": {"main_battery": gauge}}
    gateway.windows["mission/ListMissions"] = [{"name": mission, "about": "", "state": "running", "claims": []}]
    gateway.latched["/diagnostics_toplevel_state"] = {"level": 0, "message": ""}
    gateway.latched["/odom"] = {"pose": {"pose": {"position": {"x": x, "y": 1.0}, "orientation": {"z": 0.0, "w": 1.0}}}}


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
    expect(page.locator(".fleet-map")).to_contain_text("Digger at 4.00, 1.00 m")
    fleet.say("/odom", {"pose": {"pose": {"position": {"x": 2.0, "y": 1.0}, "orientation": {"z": pi, "w": 1.0}}}})
    expect(page.locator(".fleet-map")).to_contain_text("Digger at 2.00, 1.00 m")
    assert violations(page) == []


def test_it_fits_a_phone(open_page: Callable[..., Page], fleet: FakeGateway) -> None:
    page = open_page(page_name="fleet", foreign=[fleet.url, "http://127.0.0.1:9/"], viewport=PHONE)
    expect(page.locator("article").first).to_be_visible()
    assert not overflows(page)
