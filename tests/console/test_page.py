"""The console's page in a real browser, against a fake gateway: it drives, lets go, stops, and can be read."""

from __future__ import annotations

import gzip
import itertools
import time
from collections.abc import Callable
from pathlib import Path
from threading import Event
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.console.browser import CHROMIUM
from tests.console.conftest import Pages
from tests.console.fake_gateway import CONFIG, RUNNING, FakeGateway
from tests.console.looks import PHONE, expect_readable, overflows, too_small, violations
from tests.soak import Soak

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")

MOST = 1_000_000  # [bytes] of the compressed page
FIRST_PAINT = 1500  # [ms]


def wait_for(condition: Callable[[], Any], page: Page, seconds: float = 10.0) -> None:
    """Let the browser work until the condition is true."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        page.wait_for_timeout(20)


def drive_by_keys(page: Page, gateway: FakeGateway) -> None:
    page.keyboard.down("Shift")
    page.keyboard.down("ArrowUp")
    wait_for(lambda: len(gateway.commands()) > 2, page)


def expect_stop(page: Page, gateway: FakeGateway, since: float) -> None:
    """Expect zero soon after a moment [s], and no motion any more."""
    wait_for(lambda: [command for command in gateway.commands(since) if command[1:] == (0, 0)], page)
    first = next(at for at, *motion in gateway.commands(since) if motion == [0, 0])
    assert first - since < 0.4, "on a busy machine; at once on a free one"
    page.wait_for_timeout(300)
    assert all(command[1:] == (0, 0) for command in gateway.commands(first))


def driven(gateway: FakeGateway, since: float) -> list[tuple[float, float, float]]:
    """Return the commands since a moment [s], from the first one that moves on."""
    return list(itertools.dropwhile(lambda command: command[1:] == (0, 0), gateway.commands(since)))


def test_the_page_shows_the_robot_and_its_batteries(open_page: Callable[..., Page]) -> None:
    page = open_page(name="")
    expect(page).to_have_title("Drive · turtlebot")
    gauge = page.locator("battery-gauge").filter(has_text="Laptop battery")
    expect(gauge).to_contain_text("23%")
    expect(gauge).to_contain_text("Low")
    expect(page.locator("battery-gauge").filter(has_text="Main supply")).to_contain_text("12.4")
    paint = page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    assert paint < 4 * FIRST_PAINT, "a busy machine is given time"


def test_shift_and_a_key_drive_ten_times_a_second_until_one_is_let_go(
    open_page: Callable[..., Page], gateway: FakeGateway
) -> None:
    page = open_page()
    drive_by_keys(page, gateway)
    page.wait_for_timeout(800)
    commands = gateway.commands()
    assert {command[1:] for command in commands} == {(0.25, 0)}
    rate = (len(commands) - 1) / (commands[-1][0] - commands[0][0])
    assert 7 < rate < 11
    expect(page.locator(".axis").first).to_contain_text("0.24")
    expect(page.locator(".lease")).to_contain_text("You are driving")
    assert gateway.calls("/console/drive") == [{"take": True, "name": "Ada"}]
    since = time.monotonic()
    page.keyboard.up("Shift")
    expect_stop(page, gateway, since)
    wait_for(lambda: gateway.calls("/console/drive")[-1]["take"] is False, page)
    frames = [frame for _, frame in gateway.frames if frame["op"] == "publish"]
    assert all(a["sent"] < b["sent"] for a, b in itertools.pairwise(frames))


def test_keys_alone_do_not_drive_and_say_why(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    page = open_page()
    page.keyboard.down("KeyW")
    expect(page.locator(".hint").first).to_have_text("Hold Shift as well to drive.")
    page.wait_for_timeout(300)
    assert gateway.commands() == []


def test_who_looks_away_stops_and_hands_back(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    page = open_page()
    for away in (
        "window.dispatchEvent(new Event('blur'))",
        "window.dispatchEvent(new Event('pagehide'))",
        "Object.defineProperty(document, 'hidden', {value: true});"
        "document.dispatchEvent(new Event('visibilitychange'))",
    ):
        gateway.frames.clear()
        drive_by_keys(page, gateway)
        assert {command[1:] for command in gateway.commands()} == {(0.25, 0)}
        since = time.monotonic()
        page.evaluate(away)
        expect_stop(page, gateway, since)
        assert gateway.calls("/console/drive")[-1] == {"take": False, "name": "Ada"}, away
        page.keyboard.up("ArrowUp")
        page.keyboard.up("Shift")


@pytest.mark.soak  # as a finger does
def test_the_pad_drives_in_proportion_while_the_mouse_holds_it(
    open_page: Callable[..., Page], gateway: FakeGateway
) -> None:
    page = open_page()
    box = page.locator("drive-pad").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] * 0.3)
    page.wait_for_timeout(200)
    assert gateway.commands() == []
    page.mouse.down()
    wait_for(lambda: len(gateway.commands()) > 2, page)
    _, forward, turn = gateway.commands()[-1]
    assert forward == pytest.approx(0.25 * 0.5, abs=0.01)
    assert turn == 0
    page.mouse.move(box["x"] - 300, box["y"] + box["height"] / 2)
    wait_for(lambda: gateway.commands()[-1][1:] == (0, 0.75), page)
    since = time.monotonic()
    page.mouse.up()
    expect_stop(page, gateway, since)


def test_a_finger_drives_until_it_is_lifted_or_taken_away(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    page = open_page(viewport=PHONE, has_touch=True, is_mobile=True)
    expect(page.locator(".hint").first).to_have_text("Touch the pad and drag. Lift your finger to stop.")
    box = page.locator("drive-pad").bounding_box()
    assert box is not None
    device = page.context.new_cdp_session(page)
    point = {"x": box["x"] + box["width"] * 0.8, "y": box["y"] + box["height"] * 0.8}

    def drive_until(end: str) -> None:
        begin = time.monotonic()
        device.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [point]})
        wait_for(lambda: len(driven(gateway, begin)) > 2, page)
        assert all(forward < 0 and turn < 0 for _, forward, turn in driven(gateway, begin))
        since = time.monotonic()
        device.send("Input.dispatchTouchEvent", {"type": end, "touchPoints": []})
        expect_stop(page, gateway, since)

    drive_until("touchEnd")
    drive_until("touchCancel")


def test_stop_needs_no_lease_and_nothing_moves_until_release(
    open_page: Callable[..., Page], gateway: FakeGateway
) -> None:
    is_typed = Event()

    def release(args: object) -> dict[str, Any]:
        is_typed.wait()
        gateway.show(RUNNING, {"stop": None})
        return {"success": True, "message": ""}

    gateway.answers["/console/release"] = release
    page = open_page(name="")
    page.get_by_role("link", name="Drive").click()
    page.keyboard.press("Space")
    wait_for(lambda: gateway.calls("/console/stop") == [{}], page)
    page.get_by_role("button", name="Release").click()
    page.fill("#name", "Ada")
    is_typed.set()
    expect(page.get_by_role("button", name="Release")).to_be_hidden()
    assert gateway.calls("/console/release") == [{}]
    page.keyboard.press("Enter")  # still in the field: else it would press STOP
    drive_by_keys(page, gateway)
    since = time.monotonic()
    page.get_by_role("button", name="STOP").click()
    expect_stop(page, gateway, since)
    wait_for(lambda: len(gateway.calls("/console/stop")) == 2, page)
    page.get_by_role("button", name="Rename").evaluate("button => button.focus()")  # as a click does, not as Tab
    page.keyboard.press("Space")
    wait_for(lambda: len(gateway.calls("/console/stop")) == 3, page)
    expect(page.get_by_role("button", name="Rename")).to_be_visible()
    expect(page.get_by_text("Nothing moves until you press Release")).to_be_visible()
    page.keyboard.up("Shift")
    page.keyboard.up("ArrowUp")
    count = len(gateway.calls("/console/drive"))
    page.keyboard.down("Shift")
    page.keyboard.down("ArrowUp")
    page.wait_for_timeout(200)
    assert len(gateway.calls("/console/drive")) == count


def test_somebody_else_who_drives_is_named(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    gateway.others = "Ben"
    page = open_page()
    expect(page.locator(".lease")).to_contain_text("Ben is driving")
    page.keyboard.down("Shift")
    page.keyboard.down("ArrowUp")
    expect(page.locator(".hint").first).to_have_text("Ben is driving.")
    page.wait_for_timeout(300)
    assert (gateway.commands(), len(gateway.calls("/console/drive"))) == ([], 1)
    page.keyboard.up("ArrowUp")
    gateway.others = None
    page.keyboard.down("ArrowUp")
    wait_for(lambda: len(gateway.commands()) > 2, page)
    gateway.others = "Ben"
    expect(page.locator(".hint").first).to_have_text("You no longer drive. Let go, then press again.")
    expect(page.locator(".lease")).to_contain_text("Ben is driving")
    count = len(gateway.commands())
    page.wait_for_timeout(300)
    assert len(gateway.commands()) - count < 2


def test_without_a_name_nobody_drives(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    gateway.others = "Ben"
    page = open_page(name="")
    expect(page.locator(".lease")).to_contain_text("Ben is driving")
    page.locator("#name").press_sequentially("  Ad")
    gateway.others = None
    expect(page.locator(".lease")).not_to_contain_text("Ben")
    expect(page.locator("#name")).to_be_focused()
    page.keyboard.type("a ")
    page.locator("#name").blur()
    page.keyboard.down("Shift")
    page.keyboard.down("KeyA")
    expect(page.locator(".hint").first).to_have_text("Enter your name first.")
    assert gateway.calls("/console/drive") == []
    page.keyboard.up("KeyA")
    page.keyboard.up("Shift")
    page.locator("#name").press("Enter")
    page.reload()
    expect(page.locator(".lease")).to_contain_text("You are Ada")


def test_sliders_limit_the_speed_and_shift_with_arrows_drives_all_the_same(
    open_page: Callable[..., Page], gateway: FakeGateway
) -> None:
    page = open_page()
    slider = page.get_by_label("Top speed")
    slider.focus()
    page.keyboard.press("Home")
    expect(page.locator(".slider output").first).to_have_text("0.01\u202fm/s")
    page.keyboard.press("End")
    drive_by_keys(page, gateway)
    assert gateway.commands()[-1][1:] == (0.5, 0)
    assert slider.input_value() == "0.5"


def test_a_lost_connection_is_said_and_comes_back_without_motion(
    open_page: Callable[..., Page], gateway: FakeGateway
) -> None:
    page = open_page()
    drive_by_keys(page, gateway)
    gateway.is_away = True
    gateway.drop()
    lost = page.get_by_role("alert").filter(has_text="Connection lost")
    expect(lost).to_have_text("Connection lost. The robot stops whoever drives by hand; missions and goals go on.")
    page.get_by_role("button", name="STOP").click()
    expect(page.get_by_role("alert").filter(has_text="STOP has not arrived: not connected.")).to_be_visible()
    page.get_by_role("button", name="Release").click()
    gateway.is_away = False
    expect(page.locator(".connection")).to_have_text("Connected")
    since = time.monotonic()
    expect(page.locator("battery-gauge").first).to_contain_text("78%")
    page.wait_for_timeout(300)
    assert gateway.commands(since) == []
    page.keyboard.up("ArrowUp")
    page.keyboard.down("ArrowUp")
    wait_for(lambda: gateway.commands(since), page)


@pytest.mark.soak
def test_a_robot_without_a_base_and_without_batteries_says_so(
    open_page: Callable[..., Page], gateway: FakeGateway
) -> None:
    gateway.config = {"robot": "arm", "drive": None, "values": {}}
    page = open_page()
    expect(page.get_by_text("This robot has no base to drive.")).to_be_visible()
    expect(page.get_by_text("This robot reports no battery.")).to_be_visible()
    assert violations(page) == []


def test_the_manifest_says_which_pages_there_are_and_in_which_order(
    open_page: Callable[..., Page], gateway: FakeGateway
) -> None:
    gateway.config = {**gateway.config, "pages": ["mission", "drive"], "first_page": "map"}
    links = open_page().get_by_label("Pages").get_by_role("link")
    expect(links).to_have_text(["Mission", "Drive"])
    expect(links.first).to_have_attribute("aria-current", "page")


def test_an_open_page_follows_what_the_robot_says_about_itself(
    open_page: Callable[..., Page], gateway: FakeGateway
) -> None:
    def changes(**config: Any) -> None:
        gateway.config = {**gateway.config, **config}

    page = open_page()
    changes(drive={**gateway.config["drive"], "max_speed": 0.2})
    gateway.drop()
    expect(page.locator("#top-forward")).to_have_attribute("max", "0.2")
    expect(page.locator(".connection")).to_have_text("Connected")
    drive_by_keys(page, gateway)
    changes(places={"dock": {"x": 1.0, "y": 0.0, "heading": 0.0}}, pages=["drive", "map"])
    with page.expect_response("**/console/config"):
        gateway.show("config", 1)  # as after `apply`, without a restart
    expect(page.get_by_label("Driver")).to_contain_text("You are driving")
    page.keyboard.up("Shift")
    page.get_by_role("link", name="Map").click()
    expect(page.get_by_label("Pages").get_by_role("link")).to_have_text(["Drive", "Map"])
    expect(page.get_by_label("Places")).to_contain_text("1.00")
    page.evaluate("addEventListener('beforeunload', event => event.preventDefault())")  # as an unsaved text does
    page.evaluate("window.isKept = true")
    changes(places={"dock": {"x": 2.0, "y": 0.0, "heading": 0.0}})
    gateway.show("config", 2)
    expect(page.get_by_label("Places")).to_contain_text("2.00")
    assert page.evaluate("window.isKept")


def test_a_page_whose_port_another_robot_has_got_shows_that_one_or_says_so(
    open_page: Callable[..., Page], gateway: FakeGateway
) -> None:
    page = open_page()
    expect(page.locator(".connection")).to_have_text("Connected")
    gateway.config = {**gateway.config, "robot": "digger"}
    gateway.drop()
    expect(page.get_by_role("heading", level=1)).to_have_text("digger")
    expect(page.locator(".connection")).to_have_text("Connected")
    page.evaluate("addEventListener('beforeunload', event => event.preventDefault())")  # as an unsaved text does
    page.evaluate("window.isKept = true")
    gateway.config = {**gateway.config, "robot": "porter"}
    gateway.drop()
    expect(page.get_by_role("alert").filter(has_text="Robot porter answers here now, not digger")).to_be_visible()
    expect(page.locator(".connection")).to_have_text("Not connected")
    expect(page.get_by_role("heading", level=1)).to_have_text("digger")
    assert page.evaluate("window.isKept")


def test_whoever_is_not_known_any_more_logs_in_and_loses_nothing(
    open_page: Callable[..., Page], gateway: FakeGateway
) -> None:
    page = open_page(name="")
    page.fill("#name", "Ada")
    gateway.is_locked = True
    gateway.drop()
    expect(page.get_by_role("alert")).to_contain_text("The robot does not know you any more")
    gateway.is_locked = False
    page.route("**/console/login", lambda route: route.fulfill(json={}))
    page.fill("#token", "new")
    page.keyboard.press("Enter")
    expect(page.locator(".connection")).to_have_text("Connected")
    expect(page.locator("#name")).to_have_value("Ada")
    page.unroute("**/console/login")


@pytest.mark.soak
def test_what_is_no_robot_is_an_error_with_a_way_out(pages: Pages, gateway: FakeGateway) -> None:
    gateway.config = []  # type: ignore[assignment]
    page = pages.blank()
    page.goto(gateway.url)
    expect(page.get_by_role("alert")).to_contain_text("What answers at this address is not a robot's console.")
    assert violations(page) == []
    gateway.config = CONFIG
    page.get_by_role("button", name="Try again").click()
    expect(page.locator(".connection")).to_have_text("Connected")


def test_everyone_can_read_and_reach_it(open_page: Callable[..., Page], gateway: FakeGateway, soak: Soak) -> None:
    page = open_page(name="")

    def name() -> None:
        page.fill("#name", "A very long name, as some people have it")
        page.keyboard.press("Enter")

    def stop() -> None:
        page.get_by_role("button", name="STOP").click()

    def lose() -> None:
        gateway.is_away = True
        gateway.drop()
        expect(page.get_by_role("alert").filter(has_text="Connection lost")).to_be_visible()

    for prepare in (None, name, stop, lose):
        if prepare:
            prepare()
        page.wait_for_timeout(100)
        for width in (1280, 768, 390, 320):
            page.set_viewport_size({"width": width, "height": 844})
            assert not overflows(page)
            assert too_small(page) == []
        if soak.is_on or prepare in (None, lose):  # the last shows what all before have done
            expect_readable(page)


def test_the_tab_key_reaches_every_control_and_shows_where_it_is(open_page: Callable[..., Page]) -> None:
    page = open_page(name="")
    wanted = ["STOP", *page.locator("nav a").all_inner_texts(), "name", "OK", "pad", "top-forward", "top-turn"]
    for name in wanted if len(wanted) > 7 else [name for name in wanted if name != "Drive"]:
        page.keyboard.press("Tab")
        focused = page.evaluate("document.activeElement.id || document.activeElement.textContent || 'pad'")
        assert focused == name
        assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid"


def test_the_page_is_small(static: Path) -> None:
    assert sum(len(gzip.compress(file.read_bytes())) for file in static.rglob("*") if file.is_file()) < MOST
