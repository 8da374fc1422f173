"""The editor of missions in a real browser; behind it, the real editor and a project on disk."""

from __future__ import annotations

import os
import re
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from rbxcompose.base.requests import Refused
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.tools.mission_editor.editor import REQUESTS, MissionEditor
from tests.console.browser import CHROMIUM
from tests.console.edited_robot import LiveText
from tests.console.fake_gateway import CONFIG, FakeGateway
from tests.console.looks import PHONE, WIDE, expect_fit, violations
from tests.mission_editor.test_editor import FETCH, ROBOT

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")

TEXT = "Text of the mission"


class Project:
    """A robot on disk, and its editor behind a gateway."""

    def __init__(self, gateway: FakeGateway, folder: Path) -> None:
        self.gateway, self.robot, self.file = (
            gateway,
            folder / "robots/fetcher/robot.yaml",
            folder / "missions/fetch.yaml",
        )
        for file, text in ((self.robot, ROBOT), (self.file, FETCH)):
            file.parent.mkdir(parents=True)
            file.write_text(text, encoding="utf-8")
        self.editor = MissionEditor(self.compiled, self.robot)
        self.live = LiveText(gateway, self.text)
        for do in REQUESTS:
            gateway.answers[f"/console/mission/{do}"] = partial(self.answer, do)
        plain = {"about": "Fetch it.", "claims": [], "inputs": [], "starts": []}
        gateway.windows["mission/ListMissions"] = [{"name": "fetch", "state": "idle", **plain}]

    def compiled(self, unsaved: Any) -> Any:
        return compile_robot(str(self.robot), environment=os.environ, unsaved=unsaved)

    def answer(self, do: str, given: dict[str, Any]) -> dict[str, Any]:
        try:
            return {"success": True, "message": "", "answer": self.editor.answer({"do": do, **given})}
        except Refused as refusal:
            return {"success": False, "message": str(refusal), "answer": None}

    def text(self) -> str:
        return self.file.read_text(encoding="utf-8")


@pytest.fixture
def project(gateway: FakeGateway, tmp_path: Path) -> Project:
    return Project(gateway, tmp_path)


def edits(page: Page) -> Page:
    page.get_by_role("button", name="Edit").click()
    expect(page.get_by_role("textbox", name=TEXT)).to_be_visible()
    return page


def types(page: Page, old: str, new: str) -> None:
    """Replace a word of the text as a person does."""
    page.locator(".editor-text .cm-line", has_text=old).first.click()
    page.keyboard.press("End")
    for _ in range(len(old)):
        page.keyboard.press("Backspace")
    page.keyboard.type(new)


def test_a_mistake_is_marked_as_it_is_typed_and_a_button_fixes_it(
    open_page: Callable[..., Page], project: Project
) -> None:
    page = edits(open_page(page_name="mission"))
    expect(page.get_by_text("No mistakes")).to_be_visible()
    types(page, "wait: 2 s", "wait: 2 secs")
    row = page.get_by_label("Mistakes", exact=True).get_by_role("listitem").first
    expect(row).to_contain_text("Line 7")
    expect(page.locator(".cm-says")).to_be_visible()
    assert violations(page) == []
    row.get_by_role("button", name="Line 7").click()
    expect(page.get_by_role("textbox", name=TEXT)).to_be_focused()
    types(page, "wait: 2 secs", "go_to: tabel")
    page.get_by_role("button", name=re.compile("table")).click()
    expect(page.get_by_text("No mistakes")).to_be_visible()
    expect(page.locator(".cm-content")).to_contain_text("- go_to: table")
    page.get_by_role("button", name="Undo").click()
    expect(page.locator(".cm-content")).to_contain_text("tabel")


@pytest.mark.soak  # findings of another origin, shown in the same list
def test_what_check_finds_is_told_when_it_opens_and_until_then_that_it_is_checked(
    open_page: Callable[..., Page], project: Project, gateway: FakeGateway
) -> None:
    project.file.write_text(FETCH.replace("do:", "inputs:\n  speed: {type: speed}\ndo:"), encoding="utf-8")
    seen = threading.Event()

    def check(given: dict[str, Any]) -> dict[str, Any]:
        assert seen.wait(10)
        return project.answer("check", given)

    gateway.answers["/console/mission/check"] = check
    page = edits(open_page(page_name="mission"))
    expect(page.get_by_text("Checking…", exact=True)).to_be_visible()
    seen.set()
    expect(page.get_by_text("1 warning", exact=True)).to_be_visible()
    expect(page.get_by_label("Mistakes", exact=True)).to_contain_text("speed")


@pytest.mark.soak
def test_space_in_a_text_is_a_space_and_stops_nothing(
    open_page: Callable[..., Page], project: Project, gateway: FakeGateway
) -> None:
    page = edits(open_page(page_name="mission"))
    types(page, "2 s", "3 s")
    expect(page.locator(".cm-content")).to_contain_text("wait: 3 s")
    assert gateway.calls("/console/stop") == []
    page.locator("body").evaluate("() => document.activeElement.blur()")
    page.keyboard.press("Space")
    expect(page.get_by_text("Nothing moves until you press Release")).to_be_visible()


def test_save_shows_what_changes_writes_it_and_brings_it_to_the_robot_while_it_runs(
    open_page: Callable[..., Page], project: Project
) -> None:
    page = edits(open_page(page_name="mission"))
    expect(page.get_by_role("button", name="Save")).to_be_disabled()
    types(page, "wait: 2 s", "wait: 3 s")
    page.get_by_role("button", name="Save").click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("+  - wait: 3 s")
    assert violations(page) == []
    if (shots := os.environ.get("SHOTS")) is not None:
        page.screenshot(path=f"{shots}/save.png")
    page.get_by_role("button", name="STOP").click()
    expect(page.get_by_text("Nothing moves until you press Release")).to_be_visible()
    dialog.get_by_role("button", name="Not now").click()
    assert project.text() == FETCH
    page.get_by_role("button", name="Save").click()
    page.get_by_role("dialog").get_by_role("button", name="Write it").click()
    expect(page.get_by_text("Saved in 'missions/fetch.yaml'")).to_be_visible()
    assert project.text() == FETCH.replace("2 s", "3 s")
    expect(page.get_by_role("button", name="Save")).to_be_disabled()
    page.get_by_role("button", name="Change the running robot").click()
    dialog = page.get_by_role("dialog")
    expect(dialog.get_by_role("list", name="What happens to what runs")).to_contain_text("goes on where it is")
    dialog.get_by_role("button", name="Change it").click()
    expect(page.get_by_text("The robot is changed.")).to_be_visible()
    assert project.live.runs_with == project.text()


def test_an_editor_stays_while_the_missions_do_not_answer(
    open_page: Callable[..., Page], project: Project, gateway: FakeGateway
) -> None:
    page = edits(open_page(page_name="mission"))
    types(page, "2 s", "3")
    gateway.refuse("mission/ListMissions", "'mission' is not active")
    expect(page.get_by_text("The missions do not answer now: 'mission' is not active.")).to_be_visible()
    page.keyboard.type(" s")
    expect(page.locator(".cm-content")).to_contain_text("wait: 3 s")
    gateway.show("mission/ListMissions", [])  # the robot has been changed to one without missions
    expect(page.get_by_text("The running robot does not have this mission.")).to_be_visible()
    expect(page.get_by_role("textbox", name=TEXT)).to_be_focused()
    assert gateway.calls("/console/stop") == []


def test_what_became_of_a_save_stays_until_the_next_action(
    open_page: Callable[..., Page], project: Project, gateway: FakeGateway
) -> None:
    page = edits(open_page(page_name="mission"))
    expect(page.get_by_text("No mistakes")).to_be_visible()
    checks = len(gateway.calls("/console/mission/check"))
    project.file.rename(project.file.with_suffix(".gone"))
    types(page, "wait: 2 s", "wait: 3 s")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_text("Not saved: ")).to_be_visible()
    gateway.calls("/console/mission/check", checks + 1)
    expect(page.get_by_text("No mistakes")).to_be_visible()
    expect(page.get_by_text("Not saved: ")).to_be_visible()
    types(page, "wait: 3 s", "wait: 4 s")
    expect(page.get_by_text("Not saved: ")).to_be_hidden()


@pytest.mark.soak
def test_a_file_that_others_changed_is_not_overwritten(open_page: Callable[..., Page], project: Project) -> None:
    page = edits(open_page(page_name="mission"))
    theirs = FETCH.replace("table", "dock")
    project.file.write_text(theirs, encoding="utf-8")
    types(page, "wait: 2 s", "wait: 3 s")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_text("has changed on disk")).to_be_visible()
    assert project.text() == theirs
    page.get_by_role("button", name="Load it").click()
    expect(page.locator(".cm-content")).to_contain_text("go_to: dock")
    page.get_by_role("button", name="Undo").click()
    expect(page.locator(".cm-content")).to_contain_text("wait: 3 s")


@pytest.mark.soak
def test_after_a_connection_was_lost_in_a_save_it_is_told_what_became_of_it(
    open_page: Callable[..., Page], project: Project, gateway: FakeGateway
) -> None:
    def lost(given: dict[str, Any]) -> dict[str, Any]:
        answer = project.answer("save", given)
        if not given.get("dry_run"):
            gateway.drop()
        return answer

    gateway.answers["/console/mission/save"] = lost
    page = edits(open_page(page_name="mission"))
    types(page, "wait: 2 s", "wait: 3 s")
    page.get_by_role("button", name="Save").click()
    page.get_by_role("dialog").get_by_role("button", name="Write it").click()
    expect(page.get_by_text("The connection is back: it was saved.")).to_be_visible()
    assert project.text() == FETCH.replace("2 s", "3 s")


def test_what_somebody_else_saves_is_compared_with_the_robot_that_runs(
    open_page: Callable[..., Page], project: Project, gateway: FakeGateway
) -> None:
    compare, wrong = gateway.answers["/console/robot/compare"], project.text() + "wrong\n"
    refused = {"success": False, "message": "its files have 1 error", "answer": None}
    gateway.answers["/console/robot/compare"] = lambda given: refused if project.text() == wrong else compare(given)
    project.file.write_text(wrong, encoding="utf-8")
    page = edits(open_page(page_name="mission"))
    expect(page.get_by_text("What is saved cannot run: its files have 1 error")).to_be_visible()
    project.file.write_text(project.live.runs_with, encoding="utf-8")
    gateway.show("changes", 1)
    expect(page.locator(".live-changes")).to_be_empty()


def test_after_a_connection_was_lost_it_is_checked_and_compared_again(
    open_page: Callable[..., Page], project: Project, gateway: FakeGateway
) -> None:
    loses = True

    def losing(answer: Callable[[dict[str, Any]], Any], given: dict[str, Any]) -> Any:
        if loses:
            gateway.is_away = True
            gateway.drop()
        return answer(given)

    for service in ("/console/mission/check", "/console/robot/compare"):
        gateway.answers[service] = partial(losing, gateway.answers[service])
    page = edits(open_page(page_name="mission"))
    expect(page.get_by_text("It is not known whether the robot runs what is saved: the connection")).to_be_visible()
    expect(page.get_by_text("Not checked")).to_be_visible()
    loses = gateway.is_away = False
    page.get_by_role("button", name="Try now").click()
    expect(page.get_by_text("No mistakes")).to_be_visible()
    expect(page.locator(".live-changes")).to_be_empty()
    expect(page.get_by_text("It could not be checked")).to_have_count(0)


@pytest.mark.soak
def test_what_was_typed_stays_while_another_page_is_shown(open_page: Callable[..., Page], project: Project) -> None:
    page = edits(open_page(page_name="mission"))
    types(page, "wait: 2 s", "wait: 3 s")
    page.get_by_role("link", name="Log").click()
    page.get_by_role("link", name="Mission").click()
    expect(edits(page).locator(".cm-content")).to_contain_text("wait: 3 s")
    page.get_by_role("button", name="Undo").click()


@pytest.mark.soak  # who may only look is tested with the mux
def test_who_may_not_configure_reads_and_does_not_change(
    open_page: Callable[..., Page], project: Project, gateway: FakeGateway
) -> None:
    gateway.config = {**CONFIG, "role": "operate"}
    page = edits(open_page(page_name="mission"))
    expect(page.get_by_text("open the link of the role configure")).to_be_visible()
    page.get_by_role("textbox", name=TEXT).click()
    page.keyboard.type("x")
    expect(page.get_by_role("button", name="Save")).to_be_disabled()
    expect(page.get_by_role("button", name="Undo")).to_be_disabled()


@pytest.mark.soak
def test_a_mission_that_cannot_be_read_says_why(open_page: Callable[..., Page], project: Project) -> None:
    project.file.write_bytes(b"\xff")
    page = open_page(page_name="mission")
    page.get_by_role("button", name="Edit").click()
    expect(page.get_by_text("is not UTF-8")).to_be_visible()
    project.file.write_text(FETCH, encoding="utf-8")
    page.get_by_role("button", name="Try again").click()
    expect(page.get_by_role("textbox", name=TEXT)).to_be_visible()


def test_it_fits_the_window_and_the_finger(open_page: Callable[..., Page], project: Project) -> None:
    project.file.write_text(FETCH.replace("table ", "tabel "), encoding="utf-8")
    page = edits(open_page(page_name="mission"))
    for size in (WIDE, PHONE):
        page.set_viewport_size(size)
        expect_fit(page)
        if (shots := os.environ.get("SHOTS")) is not None:
            page.screenshot(path=f"{shots}/editor_{size['width']}.png", full_page=True)
        close = page.get_by_role("button", name="Close")
        close.evaluate("button => button.scrollIntoView()")
        stop = page.get_by_role("button", name="STOP").bounding_box()
        over = close.bounding_box()
        assert stop
        assert over
        assert over["y"] >= stop["y"] + stop["height"] or over["y"] + over["height"] <= stop["y"]


def block(page: Page, text: str) -> Any:
    return page.get_by_role("treeitem").filter(has_text=text).last


def lines(page: Page) -> list[str]:
    """Return the lines of the text as they are shown, without what is said at their ends."""
    shown: list[str] = page.locator(".cm-line").evaluate_all(
        "lines => lines.map(line => [...line.childNodes].filter(one => !one.classList?.contains('cm-says'))"
        ".map(one => one.textContent).join(''))"
    )
    return shown


def test_steps_are_moved_copied_and_deleted_by_keys_and_added_behind_the_chosen_one_by_a_search(
    open_page: Callable[..., Page], project: Project
) -> None:
    page = edits(open_page(page_name="mission"))
    block(page, "go_to table").focus()
    page.keyboard.press("Home")
    page.keyboard.press("Alt+ArrowDown")
    expect(page.locator(".cm-line").nth(5)).to_contain_text("wait")
    assert lines(page)[5:7] == ["  - wait: 2 s", "  - go_to: table   # there"]
    expect(block(page, "go_to table")).to_be_focused()
    page.keyboard.press("Insert")
    expect(page.get_by_role("treeitem")).to_have_count(3)
    page.keyboard.press("Delete")
    expect(page.get_by_role("treeitem")).to_have_count(2)
    page.keyboard.press("Alt+ArrowDown")
    expect(page.get_by_text("this is the last one here")).to_be_visible()
    page.keyboard.press("Enter")
    expect(page.get_by_role("textbox", name=TEXT)).to_be_focused()
    for _ in range(3):
        page.keyboard.press("Control+z")
    expect(page.locator(".cm-line").nth(5)).to_contain_text("go_to: table")
    assert "\n".join(lines(page)) == FETCH
    page.locator(".editor-text .cm-line", has_text="table").click()
    page.get_by_text("Add a step").click()
    expect(page.get_by_role("button", name=re.compile("^go_to Skill of"))).to_be_visible()
    page.get_by_role("searchbox").fill("do nodes of a list in order")
    assert violations(page) == []
    page.get_by_role("searchbox").fill("time wait")
    page.keyboard.press("Enter")
    expect(page.get_by_role("treeitem")).to_have_count(3)
    assert lines(page)[5:8] == ["  - go_to: table   # there", "  - wait: 5 s", "  - wait: 2 s"]


def test_the_form_of_the_step_that_is_chosen_in_the_outline_or_the_text_has_what_it_can_be_given_and_writes_it(
    open_page: Callable[..., Page], project: Project
) -> None:
    page = edits(open_page(page_name="mission"))
    block(page, "wait 2 s").locator(".outline-row").click()
    expect(page.locator(".cm-block")).to_have_text("  - wait: 2 s")
    page.locator(".editor-text .cm-line", has_text="table").click()
    expect(block(page, "go_to table")).to_have_attribute("aria-selected", "true")
    expect(block(page, "wait 2 s")).to_have_attribute("aria-selected", "false")
    expect(page.get_by_text("Options of go_to")).to_be_visible()
    place = page.locator("#option-go_to")
    expect(place).to_have_value("table")
    assert page.locator("#option-go_to-choices option").evaluate_all("all => all.map(one => one.value)") == [
        "dock",
        "table",
    ]
    place.fill("dock")
    place.press("Tab")
    expect(block(page, "go_to dock")).to_be_visible()
    page.locator("#option-timeout").fill("1 min")
    page.locator("#option-timeout").press("Enter")
    expect(block(page, "go_to dock")).to_contain_text("timeout 1 min")
    assert lines(page)[5:8] == ["  - go_to: dock   # there", "    timeout: 1 min", "  - wait: 2 s"]
    assert violations(page) == []
    page.locator("#option-timeout").fill("")
    page.locator("#option-timeout").press("Enter")
    expect(block(page, "go_to dock")).not_to_contain_text("timeout")
    assert lines(page)[5:7] == ["  - go_to: dock   # there", "  - wait: 2 s"]
    if (shots := os.environ.get("SHOTS")) is not None:
        page.get_by_text("Add a step").click()
        page.screenshot(path=f"{shots}/form.png", full_page=True)


@pytest.mark.soak
def test_what_is_typed_in_a_form_outlives_a_change_of_the_text(
    open_page: Callable[..., Page], project: Project
) -> None:
    page = edits(open_page(page_name="mission"))
    page.locator(".editor-text .cm-line", has_text="table").click()
    page.locator("#option-go_to").evaluate("one => { one.focus(); one.value = 'dock'; }")
    page.locator("#option-timeout").evaluate("one => { one.value = '1 min'; one.dispatchEvent(new Event('change')); }")
    expect(block(page, "go_to table")).to_contain_text("timeout 1 min")
    expect(page.locator("#option-go_to")).to_have_value("dock")
    page.locator("#option-go_to").press("Enter")
    expect(block(page, "go_to dock")).to_contain_text("timeout 1 min")


def test_a_dry_run_tells_the_story_and_colours_the_outline(open_page: Callable[..., Page], project: Project) -> None:
    page = edits(open_page(page_name="mission"))
    types(page, "wait: 2 s", "check: 1 > 2")
    page.get_by_role("button", name="Dry run").click()
    expect(page.get_by_text("It ended in failure after")).to_be_visible()
    expect(block(page, "go_to table")).to_contain_text("success")
    expect(block(page, "check 1 > 2")).to_contain_text("failure")
    assert page.get_by_label("Story of the dry run").get_by_role("listitem").count() > 1
    slider, robot = page.get_by_label("Time of the dry run"), page.locator(".replay map-canvas")
    assert float(str(robot.get_attribute("data-robot")).split()[0]) > 0.9
    slider.focus()
    slider.press("Home")
    expect(block(page, "go_to table")).to_contain_text("running")
    expect(block(page, "check 1 > 2")).not_to_contain_text("failure")
    page.get_by_role("button", name="Play").click()
    expect(block(page, "check 1 > 2")).to_contain_text("failure")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    assert violations(page) == []
    if (shots := os.environ.get("SHOTS")) is not None:
        page.screenshot(path=f"{shots}/dry_run.png", full_page=True)
    page.get_by_role("button", name="Test").click()
    expect(page.get_by_text("there are no tests of 'fetch'")).to_be_visible()


@pytest.mark.soak
def test_a_dry_run_is_kept_as_a_test(open_page: Callable[..., Page], project: Project) -> None:
    page = edits(open_page(page_name="mission"))
    page.get_by_role("button", name="Dry run").click()
    page.get_by_role("button", name="Keep as a test").click()
    expect(page.get_by_text("The test 'missions/tests/fetch.test.yaml' expects")).to_be_visible()
    page.get_by_role("button", name="Test", exact=True).click()
    expect(page.get_by_text("1 of 1 test passed")).to_be_visible(timeout=20_000)


@pytest.mark.soak
def test_tests_run_with_the_text_that_is_not_saved(open_page: Callable[..., Page], project: Project) -> None:
    test = "rbx: 1\nkind: Test\nname: it_fetches\nrobot: ../robots/fetcher/robot.yaml\nmission: fetch\n"
    test += "expect:\n  outcome: success\n"
    project.file.with_name("fetch.test.yaml").write_text(test, encoding="utf-8")
    page = edits(open_page(page_name="mission"))
    types(page, "wait: 2 s", "check: 1 > 2")
    page.get_by_role("button", name="Test").click()
    expect(page.get_by_text("0 of 1 test passed")).to_be_visible(timeout=20_000)
    expect(page.get_by_text("They ran with the text as it is here")).to_be_visible()
    assert project.text() == FETCH


@pytest.mark.soak
def test_a_robot_is_watched_paused_and_resumed_beside_the_editor_on_a_phone(
    open_page: Callable[..., Page], project: Project, gateway: FakeGateway
) -> None:
    (listed,) = gateway.windows["mission/ListMissions"]
    gateway.windows["mission/ListMissions"] = [{**listed, "state": "running"}]
    gateway.answers["mission.PauseMission"] = lambda _: "fetch is paused"
    page = edits(open_page(page_name="mission", viewport=PHONE))
    page.get_by_role("button", name="Pause").click()
    expect(page.get_by_text("fetch is paused")).to_be_visible()
    gateway.show("mission/ListMissions", [{**listed, "state": "paused"}])
    expect(page.get_by_role("button", name="Resume")).to_be_visible()
    expect(page.get_by_role("textbox", name=TEXT)).to_be_visible()


@pytest.mark.soak  # what is made is tested without a browser
def test_a_new_mission_is_made_from_a_template_and_opened(
    open_page: Callable[..., Page], project: Project, gateway: FakeGateway
) -> None:
    page = open_page(page_name="mission")
    page.get_by_role("button", name="New mission").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Name").fill("fetch")
    dialog.get_by_label("What it does").select_option("deliver")
    dialog.get_by_role("button", name="Make it").click()
    expect(dialog.get_by_role("alert")).to_contain_text("it is taken")
    assert violations(page) == []
    if (shots := os.environ.get("SHOTS")) is not None:
        page.screenshot(path=f"{shots}/new.png")
    dialog.get_by_label("Name").fill("bring")
    dialog.get_by_role("button", name="Make it").click()
    expect(page.get_by_text("bring in missions/bring.yaml")).to_be_visible()
    control = page.get_by_label("Control")
    expect(control.get_by_role("heading", name="Bring")).to_be_visible()
    expect(control).to_contain_text("The running robot does not have this mission.")
    expect(page.get_by_role("button", name="Start")).to_be_hidden()
    page.reload()
    waiting = page.get_by_label("Missions").get_by_role("button", name="Bring")
    expect(waiting).to_contain_text("saved, not running yet")
    expect(page.get_by_role("heading", name="Fetch")).to_be_visible()
    waiting.click()
    edits(page)
    expect(control).to_contain_text("The running robot does not have this mission.")
    (listed,) = gateway.windows["mission/ListMissions"]
    gateway.show("mission/ListMissions", [listed, {**listed, "name": "bring"}])
    expect(page.get_by_role("button", name="Start")).to_be_visible()
    expect(control.get_by_role("heading", name="Bring")).to_be_visible()
    expect(block(page, "Delivered")).to_be_visible()
    expect(page.get_by_text("No mistakes")).to_be_visible()
