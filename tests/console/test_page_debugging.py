"""Debugging a mission on its page, in a real browser."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect

from rbxcompose.base.requests import Refused
from tests.console.browser import CHROMIUM
from tests.console.fake_gateway import CONFIG, FakeGateway
from tests.console.looks import PHONE, WIDE, expect_fit, violations
from tests.console.test_page_mission import LOOK_AT, node

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")

BREAKPOINTS = "mission/ListBreakpoints"
STOP = {"node": 2, "place": "missions/patrol.yaml:9", "text": "go_to corner", "after": ""}


def arrow(outcome: str, to: str) -> dict[str, str]:
    return {"outcome": outcome, "to": to}


def picture() -> dict[str, Any]:
    to_corner = node(2, "go_to", "corner", notes=["timeout 10 s"])
    away = node(1, "state", "", to_corner, name="away", form="state", is_start=True, arrows=[arrow("success", "home")])
    home = node(3, "state", "", node(4, "go_to", "dock"), name="home", form="state", arrows=[arrow("success", "away")])
    return {"name": "patrol", "about": "", "main": node(0, "machine", "", away, home), "interrupts": [], "count": 5}


def seen(state: str = "running", *stops: dict[str, Any], by_hand: int = 0) -> dict[str, Any]:
    more = {"stopped_at": list(stops), "by_hand": by_hand, "transitions": [], "began": 1.0, "version": 1}
    statuses = {"0": 1, "1": 1, "2": 1, "3": 0, "4": 0}
    return {"mission": "patrol", "state": state, "statuses": statuses, "shown": {"rounds": "2"}, **more} | {
        "picture": picture()
    }


def listed(state: str) -> list[dict[str, Any]]:
    about = {"about": "Visit the corner.", "claims": ["base"], "starts": [], "inputs": []}
    return [{"name": "patrol", "state": state, **about}]


def breakpoint_(where: str, node_: int, outcome: str | None = None) -> dict[str, Any]:
    return {
        "mission": "patrol",
        "where": where,
        "place": "missions/patrol.yaml:9",
        "text": "",
        "spots": [[node_, outcome]],
    }


def show(gateway: FakeGateway, state: str, *stops: dict[str, Any], by_hand: int = 0) -> None:
    gateway.show("mission/ListMissions", listed(state))
    gateway.show(LOOK_AT, seen(state, *stops, by_hand=by_hand))


@pytest.fixture
def patrol(gateway: FakeGateway) -> FakeGateway:
    gateway.windows["mission/ListMissions"] = listed("running")
    gateway.windows[LOOK_AT] = seen()
    gateway.windows[BREAKPOINTS] = []
    gateway.answers["mission.ListOutcomes"] = lambda _: {
        "2": ["success", "failure", "lost"],
        "1": ["success", "failure"],
    }
    for name in ("SetBreakpoint", "ClearBreakpoints", "StepMission", "ResumeMission", "ForceNode", "JumpMission"):
        gateway.answers[f"mission.{name}"] = lambda given: f"{given['type']} is done"
    return gateway


def row(page: Page, text: str) -> Locator:
    return page.get_by_role("treeitem").filter(has_text=text).last


def done(page: Page, request: str) -> None:
    expect(page.get_by_text(f"mission.{request} is done").last).to_be_visible()


def test_a_breakpoint_is_set_and_cleared_by_a_click_and_by_a_key(
    open_page: Callable[..., Page], patrol: FakeGateway
) -> None:
    page = open_page(page_name="mission")
    point = page.get_by_role("button", name="Breakpoint at go_to corner")
    point.click()
    done(page, "SetBreakpoint")
    assert patrol.asked("mission.SetBreakpoint") == [
        {"type": "mission.SetBreakpoint", "where": "2", "mission": "patrol"}
    ]
    patrol.show(BREAKPOINTS, [breakpoint_("missions/patrol.yaml:9", 2), breakpoint_("1->home", 1, "success")])
    expect(point).to_have_attribute("aria-pressed", "true")
    leave = page.get_by_role("button", name="Breakpoint at away: success")
    expect(leave).to_have_attribute("aria-pressed", "true")
    row(page, "go_to corner").focus()
    page.keyboard.press("b")
    done(page, "ClearBreakpoints")
    leave.focus()
    page.keyboard.press("b")
    page.get_by_role("button", name="Breakpoint at home: success").click()
    row(page, "go_to dock").focus()
    patrol.answers["mission.SetBreakpoint"] = lambda given: f"that was {given['where']}"
    page.keyboard.press("b")
    expect(page.get_by_text("that was 4")).to_be_visible()
    assert [given["where"] for given in patrol.asked("mission.SetBreakpoint")] == ["2", "3->away", "4"]
    assert [given["where"] for given in patrol.asked("mission.ClearBreakpoints")] == [
        "missions/patrol.yaml:9",
        "1->home",
    ]
    assert violations(page) == []


def test_a_run_that_is_stopped_says_where_goes_on_and_takes_steps(
    open_page: Callable[..., Page], patrol: FakeGateway
) -> None:
    page = open_page(page_name="mission")
    expect(page.get_by_role("button", name="Pause")).to_be_visible()
    show(patrol, "paused", STOP, by_hand=2)
    expect(row(page, "go_to corner")).to_contain_text("stopped here, before it begins")
    control = page.get_by_label("Control")
    expect(control).to_contain_text("Stopped at missions/patrol.yaml:9, before go_to corner.")
    expect(control).to_contain_text("Changed by hand 2 times: this run cannot be reproduced without these changes.")
    assert violations(page) == []
    step = page.get_by_role("button", name="Step", exact=True)
    step.focus()
    page.keyboard.press("Enter")
    done(page, "StepMission")
    expect(step).to_be_focused()
    page.get_by_role("button", name="Continue").click()
    done(page, "ResumeMission")
    show(patrol, "running", by_hand=2)
    expect(page.get_by_text("stopped here")).to_have_count(0)
    expect(step).to_be_visible()


def test_a_step_is_ended_by_hand_and_a_machine_is_brought_into_a_state(
    open_page: Callable[..., Page], patrol: FakeGateway
) -> None:
    def refuse(_: dict[str, Any]) -> str:
        raise Refused("'2' does not run now")

    page = open_page(page_name="mission")
    row(page, "go_to corner").locator(".node-words").last.click()
    actions = page.get_by_role("group", name="What can be done with go_to corner")
    assert violations(page) == []
    actions.get_by_role("button", name="Force failure").click()
    done(page, "ForceNode")
    actions.get_by_label("Outcome of its own").select_option("lost")
    patrol.answers["mission.ForceNode"] = refuse
    actions.get_by_role("button", name="Force outcome").click()
    expect(page.get_by_text("'2' does not run now")).to_be_visible()
    forced = [(given["where"], given["outcome"]) for given in patrol.asked("mission.ForceNode")]
    assert forced == [("2", "failure"), ("2", "lost")]
    page.keyboard.press("Escape")
    expect(actions).to_have_count(0)
    show(patrol, "running", by_hand=1)  # the same picture comes again
    expect(page.get_by_text("Changed by hand once")).to_be_visible()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    actions = page.get_by_role("group", name="What can be done with home")
    expect(actions.get_by_role("button", name="Force failure")).to_have_count(0)
    actions.get_by_role("button", name="Jump to this state").click()
    done(page, "JumpMission")
    assert patrol.asked("mission.JumpMission", 1)[0]["state"] == "3"


@pytest.mark.soak
def test_data_are_set_in_their_table_with_their_type(open_page: Callable[..., Page], patrol: FakeGateway) -> None:
    def set_data(given: dict[str, Any]) -> str:
        if given["values"]["rounds"] == "many":
            raise Refused("'rounds' must be a whole number")
        return "mission patrol: done"

    datum = {"name": "rounds", "about": "a count", "choices": [], "text": "2"}
    patrol.answers |= {"mission.ListData": lambda _: [datum], "mission.SetMissionData": set_data}
    page = open_page(page_name="mission")
    page.get_by_role("button", name="Set rounds").click()
    field = page.get_by_role("textbox", name="rounds: a count")
    expect(field).to_be_focused()
    expect(field).to_have_value("2")
    field.fill("many")
    page.keyboard.press("Enter")
    form = page.get_by_role("form", name="New value of rounds")
    expect(form.get_by_role("alert")).to_have_text("'rounds' must be a whole number")
    patrol.show(LOOK_AT, seen() | {"shown": {"rounds": "3"}})
    expect(page.get_by_label("Data", exact=True).get_by_text("3", exact=True)).to_be_visible()
    expect(field).to_have_value("many")
    assert violations(page) == []
    field.fill("5")
    form.get_by_role("button", name="Set").click()
    expect(page.get_by_text("mission patrol: done")).to_be_visible()
    expect(form).to_have_count(0)
    assert patrol.asked("mission.SetMissionData", 2)[1] == {
        "type": "mission.SetMissionData",
        "values": {"rounds": "5"},
        "mission": "patrol",
    }


@pytest.mark.soak
def test_who_only_looks_sees_breakpoints_and_no_buttons(open_page: Callable[..., Page], patrol: FakeGateway) -> None:
    patrol.config = {**CONFIG, "role": "view"}
    patrol.windows[BREAKPOINTS] = [breakpoint_("go_to", 2)]
    page = open_page(page_name="mission")
    show(patrol, "paused", STOP)
    expect(row(page, "go_to corner")).to_contain_text("stopped here")
    expect(page.get_by_role("img", name="Breakpoint at go_to corner")).to_be_visible()
    expect(page.get_by_role("img", name="Breakpoint at go_to dock")).to_have_count(0)
    for name in ("Breakpoint at", "Continue", "Cancel", "Set rounds"):
        expect(page.get_by_role("button", name=name)).to_have_count(0)
    row(page, "go_to corner").locator(".node-words").last.click()
    expect(page.get_by_role("group", name="What can be done")).to_have_count(0)
    assert violations(page) == []


@pytest.mark.soak
def test_breakpoints_are_set_before_the_first_run(open_page: Callable[..., Page], patrol: FakeGateway) -> None:
    patrol.windows["mission/ListMissions"] = listed("idle")
    del patrol.windows[LOOK_AT]
    patrol.latched[f"/console/windows/{LOOK_AT}"] = {"refused": "mission patrol has not been running"}
    patrol.answers["mission.ShowPicture"] = lambda _: picture()
    page = open_page(page_name="mission")
    page.get_by_role("button", name="Breakpoint at go_to dock").click()
    done(page, "SetBreakpoint")


@pytest.mark.soak  # as the editor does
def test_debugging_fits_the_window_and_the_finger(open_page: Callable[..., Page], patrol: FakeGateway) -> None:
    patrol.windows[BREAKPOINTS] = [breakpoint_("2", 2), breakpoint_("1->home", 1, "success")]
    page = open_page(page_name="mission", has_touch=True)
    show(patrol, "paused", STOP, by_hand=1)
    row(page, "go_to corner").locator(".node-words").last.tap()
    expect(page.get_by_role("button", name="Force outcome")).to_be_visible()
    for size in (WIDE, PHONE):
        page.set_viewport_size(size)
        expect_fit(page)


@pytest.mark.soak
def test_a_phone_is_enough_to_watch_and_to_hold_a_mission(open_page: Callable[..., Page], patrol: FakeGateway) -> None:
    for name in ("PauseMission", "CancelMission"):
        patrol.answers[f"mission.{name}"] = lambda given: f"{given['type']} is done"
    page = open_page(page_name="mission", viewport=PHONE, has_touch=True)
    expect(row(page, "go_to corner")).to_contain_text("running")
    page.get_by_role("button", name="Pause").tap()
    done(page, "PauseMission")
    show(patrol, "paused")
    page.get_by_role("button", name="Resume").tap()
    done(page, "ResumeMission")
    page.get_by_role("button", name="Cancel").tap()
    done(page, "CancelMission")
    expect_fit(page)
