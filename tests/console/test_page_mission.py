"""The pages of missions and of diagnostics in a real browser."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from rbxcompose.base.requests import Refused
from tests.console.browser import CHROMIUM
from tests.console.fake_gateway import CONFIG, FakeGateway, FakeLog
from tests.console.looks import PHONE, WIDE, expect_fit, violations

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")

LOOK_AT = "mission/LookAtAll/mission/patrol"
TREE = "diagnostics/ShowDiagnostics"


def node(number: int | None, kind: str, text: str = "", *children: dict[str, Any], **more: Any) -> dict[str, Any]:
    plain = {"name": "", "role": "", "notes": [], "arrows": [], "is_start": False, "sign": "", "form": "after"}
    return {"number": number, "kind": kind, "text": text, "children": list(children), **plain, **more}


def seen(state: str, statuses: dict[str, int]) -> dict[str, Any]:
    main = node(0, "repeat", "$rounds", node(1, "go_to", "$corner", notes=["timeout 10 s"]))
    interrupt = node(None, "interrupt", "when $battery < 50 %", node(2, "recharge"), name="battery_low")
    picture = {"name": "patrol", "about": "", "main": main, "interrupts": [interrupt], "count": 3}
    shown = {"corner": "corner 2", "chores": ", ".join(f"room {turn}: vacuum 5 s" for turn in range(9))}
    look = {"mission": "patrol", "version": 1, "began": 1.0, "transitions": []}
    return {**look, "state": state, "statuses": statuses, "shown": shown, "picture": picture}


def listed(state: str) -> list[dict[str, Any]]:
    rounds = {"name": "rounds", "about": "a count", "choices": [], "default": "2"}
    speed = {"name": "speed", "about": "one of slow, fast", "choices": ["slow", "fast"], "default": "slow"}
    about = {"about": "Visit the corners.", "claims": ["base"], "starts": []}
    return [{"name": "patrol", "state": state, "inputs": [rounds, speed], **about}]


@pytest.fixture
def patrol(gateway: FakeGateway) -> FakeGateway:
    gateway.windows["mission/ListMissions"] = listed("running")
    gateway.windows[LOOK_AT] = seen("running", {"0": 1, "1": 1})
    return gateway


def test_a_mission_is_seen_live_and_every_status_has_a_word(
    open_page: Callable[..., Page], patrol: FakeGateway
) -> None:
    log = FakeLog(patrol)
    page = open_page(page_name="mission")
    step = page.get_by_role("treeitem").filter(has_text="go_to $corner").last
    expect(step).to_contain_text("running")
    rows = page.get_by_label("Data").get_by_role("row")
    expect(rows).to_contain_text(["cornercorner 2Set", "choresroom 0: vacuum 5 s, room 1"])
    lines = "cell => { const all = new Range(); all.selectNodeContents(cell); return all.getClientRects().length; }"
    assert rows.get_by_role("rowheader", name="chores").evaluate(lines) == 1  # a long value does not break the name
    interrupt = page.get_by_role("treeitem").filter(has_text="battery_low")
    expect(interrupt).to_contain_text("not yet")
    patrol.show(LOOK_AT, seen("running", {"0": 1, "1": 2, "2": 1}))
    expect(step).to_contain_text("done")
    expect(interrupt.locator(".node").first).to_contain_text("running")
    log.add("info", "mission", "recharge")
    story = page.get_by_label("Story").get_by_role("listitem")  # from the beginning on, of missions alone
    expect(story).to_have_text(["3.00 recharge", "1.00 go_to corner_1"])
    assert violations(page) == []


def test_a_person_pauses_cancels_and_starts_a_mission(open_page: Callable[..., Page], patrol: FakeGateway) -> None:
    def refuse(_: dict[str, Any]) -> str:
        raise Refused("mission patrol is waiting")

    patrol.answers |= {"mission.PauseMission": refuse, "mission.RunMission": lambda _: "patrol runs"}
    page = open_page(page_name="mission")
    page.get_by_role("button", name="Pause").click()
    expect(page.get_by_text("mission patrol is waiting")).to_be_visible()
    patrol.show("mission/ListMissions", listed("success"))
    page.get_by_role("textbox", name="Rounds").fill("3")
    page.get_by_role("combobox", name="Speed").select_option("fast")
    page.get_by_role("button", name="Start").click()
    expect(page.get_by_text("patrol runs")).to_be_visible()
    (asked,) = patrol.asked("mission.RunMission", 1)
    assert asked["inputs"] == {"rounds": "3", "speed": "fast"}
    assert asked["start"] == ""
    assert violations(page) == []


def test_the_mission_that_was_chosen_is_shown_again_after_another_page(
    open_page: Callable[..., Page], patrol: FakeGateway
) -> None:
    patrol.windows["mission/ListMissions"] = [*listed("idle"), {**listed("idle")[0], "name": "second"}]
    page = open_page(page_name="mission")
    expect(page.get_by_role("heading", name="Patrol")).to_be_visible()
    page.get_by_label("Missions").get_by_role("button", name="Second").click()
    for name in ("map", "mission"):
        page.evaluate("name => { location.hash = name; }", name)
    expect(page.get_by_role("heading", name="Second")).to_be_visible()
    expect(page.get_by_role("button", name="Second")).to_have_attribute("aria-pressed", "true")


def trigger(name: str, cause: str, **more: Any) -> dict[str, Any]:
    plain = {
        "priority": 0,
        "running": "skip",
        "next": "",
        "last": "",
        "waits": False,
        "fired": "",
        "came": "",
        "off": "",
    }
    return {"name": name, "mission": "patrol", "cause": cause, **plain, **more}


@pytest.mark.soak
def test_what_starts_missions_is_seen_live(open_page: Callable[..., Page], patrol: FakeGateway) -> None:
    nightly = trigger("nightly", "at 22:00 on mon, fri", next="Fri 2026-11-27 22:00")
    empty = trigger("empty", "when $battery < 15 %", priority=10, running="interrupt")
    patrol.windows["mission/ListTriggers"] = [nightly, empty]
    page = open_page(page_name="mission")
    triggers = page.get_by_label("Triggers")
    expect(triggers).to_contain_text("Nightly starts Patrol at 22:00 on mon, fri")
    expect(triggers).to_contain_text("On; next: Fri 2026-11-27 22:00; left out if another mission is in the way.")
    expect(triggers).to_contain_text("On; ends missions that are in the way; priority 10.")
    came = {"fired": "Thu 2026-11-26 09:00", "came": "not started: the robot is stopped"}
    patrol.show("mission/ListTriggers", [nightly, empty | came | {"off": "the robot is stopped"}])
    expect(triggers).to_contain_text("Last fired Thu 2026-11-26 09:00: not started: the robot is stopped.")
    expect(triggers).to_contain_text("Off: the robot is stopped")
    assert violations(page) == []
    patrol.show("mission/ListTriggers", [])
    expect(triggers).to_be_hidden()


def left_over(**more: Any) -> list[dict[str, Any]]:
    plain = {"doing": "go_to corner", "inputs": {"rounds": "5"}, "changed": "", "waits": False}
    return [{"mission": "patrol", "at": 1.8e9, **plain, **more}]


@pytest.mark.soak
def test_a_run_that_did_not_end_goes_on_or_starts_again(open_page: Callable[..., Page], patrol: FakeGateway) -> None:
    for name in ("ResumeMission", "CancelMission", "RunMission", "RestoreMission", "ForgetMission"):
        patrol.answers[f"mission.{name}"] = lambda given: f"{given['type']} is done"
    patrol.windows["mission/ListMissions"] = listed("paused")
    patrol.windows["mission/ListSnapshots"] = left_over(waits=True)
    page = open_page(page_name="mission")
    expect(page.get_by_text("This run did not end")).to_contain_text("at: go_to corner")
    assert violations(page) == []
    page.get_by_role("button", name="Go on from where it was").click()
    expect(page.get_by_text("mission.ResumeMission is done")).to_be_visible()
    page.get_by_role("button", name="Start again").click()
    expect(page.get_by_text("mission.RunMission is done")).to_be_visible()
    assert len(patrol.asked("mission.CancelMission")) == 1
    assert patrol.asked("mission.RunMission", 1)[0]["inputs"] == {"rounds": "5"}
    patrol.show("mission/ListMissions", listed("success"))
    patrol.show("mission/ListSnapshots", left_over())
    page.get_by_role("button", name="Go on from where it was").click()
    expect(page.get_by_text("mission.RestoreMission is done")).to_be_visible()
    patrol.show("mission/ListSnapshots", left_over(changed="the mission 'patrol' and the robot's places"))
    expect(
        page.get_by_text("It cannot go on, because the mission 'patrol' and the robot's places changed since.")
    ).to_be_visible()
    expect(page.get_by_role("button", name="Go on from where it was")).to_have_count(0)
    expect(page.get_by_role("button", name="Start again")).to_be_visible()
    page.get_by_role("button", name="Forget that run").click()
    expect(page.get_by_text("mission.ForgetMission is done")).to_be_visible()


@pytest.mark.soak
def test_what_no_test_has_tried_is_marked(open_page: Callable[..., Page], patrol: FakeGateway) -> None:
    missing = [{"node": 1, "text": "do.repeat.go_to: failure"}, {"node": 1, "text": "do.repeat.go_to: timeout"}]
    known = {"at": 1.8e9, "tests": 2, "ways": 5, "count": 3, "missing": missing}
    patrol.answers["/console/tested"] = lambda _: {"success": True, "message": "", "answer": known}
    page = open_page(page_name="mission")
    step = page.get_by_role("treeitem").filter(has_text="go_to $corner").last
    expect(step).to_contain_text("not tested: failure, timeout")
    expect(page.get_by_text("Tests took 3 of 5 ways (2 tests, ")).to_be_visible()
    assert violations(page) == []


@pytest.mark.soak
def test_tests_of_another_version_are_said_to_be_so(open_page: Callable[..., Page], patrol: FakeGateway) -> None:
    known = {"at": 1.8e9, "tests": 2, "ways": 5, "count": 4, "missing": [{"node": 1, "text": "x: failure"}]}
    patrol.answers["/console/tested"] = lambda _: {"success": True, "message": "", "answer": known}
    page = open_page(page_name="mission")
    expect(page.get_by_text("were for another version of this mission")).to_be_visible()
    expect(page.get_by_text("not tested")).to_have_count(0)


@pytest.mark.soak
@pytest.mark.parametrize(
    "why", ["", "this robot has no component of type 'mission'", "there is no query 'mission.ListMissions'"]
)
@pytest.mark.parametrize("role", ["configure", "operate"])
def test_a_robot_without_missions_gets_its_first_one_from_who_may_change_it(
    open_page: Callable[..., Page], gateway: FakeGateway, why: str, role: str
) -> None:
    gateway.config = {**CONFIG, "role": role}
    gateway.windows["mission/ListMissions"] = []
    if why:
        gateway.refuse("mission/ListMissions", why)
    page = open_page(page_name="mission")
    expect(page.get_by_text("This robot has no missions.")).to_be_visible()
    expect(page.get_by_text("in its manifest")).to_have_count(int(role == "operate"))
    expect(page.get_by_role("button", name="New mission")).to_have_count(int(role == "configure"))
    expect(page.get_by_label("Story")).to_be_hidden()
    assert violations(page) == []


def test_missions_that_do_not_answer_are_said_to_be_silent_and_what_was_shown_stays(
    open_page: Callable[..., Page], patrol: FakeGateway
) -> None:
    patrol.refuse("mission/ListMissions", "timed out")
    page = open_page(page_name="mission")
    silent = page.get_by_text("The missions do not answer now: ")
    expect(silent).to_contain_text("timed out.")
    expect(page.get_by_text("in its manifest")).to_have_count(0)
    patrol.windows["mission/ListTriggers"] = [trigger("nightly", "at 22:00")]
    patrol.show("mission/ListMissions", listed("running"))
    step = page.get_by_role("treeitem").filter(has_text="go_to $corner").last
    expect(step).to_contain_text("running")
    expect(silent).to_be_hidden()
    expect(page.get_by_label("Triggers")).to_contain_text("Nightly")
    for window in ("mission/ListMissions", "mission/ListTriggers", LOOK_AT):
        patrol.refuse(window, "'mission' is not active")
    expect(silent).to_contain_text("'mission' is not active.")
    expect(step).to_contain_text("running")
    expect(page.get_by_label("Triggers")).to_contain_text("Nightly")
    assert violations(page) == []


def line(path: str, level: int, message: str, *, is_group: bool = False) -> dict[str, Any]:
    plain = {"depth": path.count("/") - 1, "hardware_id": "", "values": [["temperature", "71 °C"]]}
    return {
        "path": path,
        "name": path.rpartition("/")[2],
        "is_group": is_group,
        "level": level,
        "message": message,
        **plain,
    }


def tree(level: int, message: str = "overheated") -> dict[str, Any]:
    lines = [
        line("/arm", level, "", is_group=True),
        line("/arm/elbow", level, message if level else "OK"),
        line("/base", 0, "", is_group=True),
        line("/base/wheels", 0, "OK"),
    ]
    return {
        "time": 100.0,
        "level": level,
        "cause": f"/arm: elbow: {message}" if level else "",
        "lines": lines,
        "left_out": 0,
    }


def test_what_is_wrong_and_why_is_seen_at_once(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    gateway.windows[TREE] = tree(0)
    change = {"number": 1, "time": 60.0, "path": "/arm/elbow", "old": 0, "new": 2, "cause": "overheated"}
    gateway.answers["diagnostics.ListChanges"] = lambda asked: [change] if asked["after"] < 1 else []
    gateway.answers["diagnostics.Acknowledge"] = lambda _: "acknowledged"
    page = open_page(page_name="diagnostics")
    expect(page.get_by_role("heading", name="Everything is fine")).to_be_visible()
    expect(page.get_by_role("button", name="wheels")).to_have_count(0)
    gateway.show(TREE, tree(2))
    expect(page.get_by_role("heading", name="Error: /arm: elbow: overheated")).to_be_visible()
    expect(page.get_by_label("Details")).to_contain_text("71 °C")
    gateway.show(TREE, tree(2) | {"time": 101.0})
    expect(page.get_by_label("History", exact=True)).to_contain_text("/arm/elbow Error overheated")
    assert violations(page) == []
    page.get_by_role("button", name="Acknowledge", exact=True).click()
    expect(page.get_by_text("acknowledged", exact=True)).to_be_visible()
    assert gateway.asked("diagnostics.Acknowledge", 1)[0]["path"] == ""


def test_a_press_and_the_focus_outlive_what_is_measured_meanwhile(
    open_page: Callable[..., Page], gateway: FakeGateway
) -> None:
    changes = [{"number": 1, "time": 60.0, "path": "/arm/elbow", "old": 0, "new": 2, "cause": "overheated"}]
    gateway.windows[TREE] = tree(2)
    gateway.answers["diagnostics.ListChanges"] = lambda asked: [
        change for change in changes if change["number"] > asked["after"]
    ]
    page = open_page(page_name="diagnostics")
    row = page.locator(".levels").get_by_role("button", name="elbow")
    details = page.get_by_label("Details")
    row.hover()
    page.mouse.down()
    gateway.show(TREE, tree(2, "overheated: 72 °C") | {"time": 101.0})
    expect(row).to_contain_text("72 °C")
    expect(page.get_by_label("History", exact=True)).to_contain_text("overheated")
    page.mouse.up()
    expect(page.get_by_role("treeitem", name="elbow")).to_have_attribute("aria-selected", "true")
    page.locator(".levels").get_by_role("button", name="arm Error", exact=True).click()
    details.get_by_role("button", name="Acknowledge this group").focus()
    changes[0] |= {"time": 2.0, "cause": "jammed"}  # the robot came up again
    gateway.show(TREE, tree(2, "jammed") | {"time": 3.0})
    expect(row).to_contain_text("jammed")
    expect(details.get_by_role("button", name="Acknowledge this group")).to_be_focused()


@pytest.mark.parametrize("name", ["diagnostics", "mission"])
@pytest.mark.soak  # as the editor of missions does
def test_it_fits_the_window_and_the_finger(open_page: Callable[..., Page], patrol: FakeGateway, name: str) -> None:
    patrol.windows[TREE] = tree(2)
    patrol.windows["mission/ListMissions"] = [*listed("running"), listed("idle")[0] | {"name": "m" * 60}]
    page = open_page(page_name=name)
    expect(page.get_by_role("treeitem").first).to_be_visible()
    for size in (WIDE, PHONE):
        page.set_viewport_size(size)
        expect_fit(page)
