"""The outline of the editor of missions in a real browser: blocks are dragged, folded, added and drawn."""

from __future__ import annotations

import os
import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Locator, Page, expect

from rbxcompose.missions.program.outcomes import RUNNING
from rbxcompose.missions.view.picture import picture_of, picture_to_data
from tests.console.browser import CHROMIUM
from tests.console.fake_gateway import FakeGateway
from tests.console.looks import PHONE, WIDE, expect_fit, violations
from tests.console.test_page_editor import Project, block, edits, lines, project
from tests.mission_editor.test_editor import FETCH

__all__ = ["project"]
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")

NESTED = f"""{FETCH}  # again and again
  - repeat: 2
    do:
      - log: one
      - log: two
  - log: the end
"""


@pytest.fixture
def page(open_page: Callable[..., Page], project: Project) -> Page:
    project.file.write_text(NESTED, encoding="utf-8")
    page = edits(open_page(page_name="mission"))
    expect(page.get_by_text("No mistakes")).to_be_visible()  # what is said of the text moves what is below
    return page


def shot(page: Page, name: str) -> None:
    if (shots := os.environ.get("SHOTS")) is not None:
        page.screenshot(path=f"{shots}/{name}.png", full_page=True)


def row(page: Page, text: str) -> Locator:
    found: Locator = block(page, text).locator(":scope > .outline-row")
    return found


def spot(page: Page, text: str, part: float) -> tuple[float, float]:
    """Return a place of a row: a part of its height below its top."""
    box = row(page, text).bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] * part


RESTS = """row => new Promise(done => {
  let [y, frames] = [NaN, 0];
  const look = () => {
    const now = row.getBoundingClientRect().y;
    [y, frames] = [now, now === y ? frames + 1 : 0];
    if (frames > 2) done(null); else requestAnimationFrame(look);
  };
  look();
})"""


def drags(page: Page, text: str, to: str, part: float) -> None:
    """Press a row, and move it to a place of another one; it is not dropped yet."""
    row(page, text).scroll_into_view_if_needed()
    page.mouse.move(*spot(page, text, 0.5))
    page.mouse.down()
    page.mouse.move(*spot(page, to, 0.5), steps=4)
    row(page, to).evaluate(RESTS)  # at an edge of the tree, the drag scrolls
    page.mouse.move(*spot(page, to, part))


def test_a_step_is_dragged_to_a_gap_with_its_comments(page: Page, project: Project) -> None:
    drags(page, "repeat 2", "go_to table", 0.1)
    expect(page.get_by_text("Drop it before go_to table")).to_be_visible()
    shot(page, "drag")
    assert violations(page) == []
    page.mouse.up()
    expect(page.locator(".cm-line").nth(5)).to_contain_text("# again and again")
    assert lines(page)[5:10] == NESTED.split("\n")[7:12]
    expect(block(page, "repeat 2")).to_have_attribute("aria-selected", "true")
    page.get_by_role("button", name="Undo").click()
    expect(page.locator(".cm-line").nth(5)).to_contain_text("go_to: table")
    assert "\n".join(lines(page)) == NESTED


@pytest.mark.soak
def test_a_step_is_dragged_into_another_one_and_out_of_it(page: Page) -> None:
    drags(page, "wait 2 s", "repeat 2", 0.5)
    expect(page.get_by_text("Drop it into repeat 2")).to_be_visible()
    page.mouse.up()
    expect(block(page, "repeat 2").get_by_role("treeitem")).to_have_count(3)
    assert lines(page)[6:12][-1] == "      - wait: 2 s"
    drags(page, "log one", "log the end", 0.9)
    page.mouse.up()
    expect(block(page, "repeat 2").get_by_role("treeitem")).to_have_count(2)
    assert lines(page)[-2] == "  - log: one"


@pytest.mark.soak
def test_escape_ends_a_drag_and_a_drop_that_cannot_be_says_why(page: Page) -> None:
    drags(page, "wait 2 s", "log the end", 0.9)
    page.keyboard.press("Escape")
    expect(page.locator(".outline-says")).to_be_empty()
    page.mouse.up()
    assert "\n".join(lines(page)) == NESTED
    drags(page, "repeat 2", "log one", 0.2)
    expect(page.get_by_text("Not into itself")).to_be_visible()
    page.mouse.up()
    drags(page, "wait 2 s", "go_to table", 0.9)
    page.mouse.up()
    expect(page.get_by_text("it is there already")).to_be_visible()
    assert "\n".join(lines(page)) == NESTED


def touched(page: Page) -> Callable[..., None]:
    session = page.context.new_cdp_session(page)

    def touch(what: str, *at: float) -> None:
        points = [{"x": at[0], "y": at[1]}] if at else []
        session.send("Input.dispatchTouchEvent", {"type": f"touch{what}", "touchPoints": points})

    return touch


@pytest.mark.soak
def test_a_finger_scrolls_and_drags_after_a_rest(open_page: Callable[..., Page], project: Project) -> None:
    project.file.write_text(NESTED, encoding="utf-8")
    page = edits(open_page(page_name="mission", viewport=PHONE, has_touch=True))
    touch = touched(page)
    row(page, "wait 2 s").scroll_into_view_if_needed()
    start, end = spot(page, "wait 2 s", 0.5), spot(page, "go_to table", 0.1)
    touch("Start", *start)
    touch("Move", *end)
    touch("End")
    assert "\n".join(lines(page)) == NESTED
    page.wait_for_timeout(200)
    row(page, "wait 2 s").scroll_into_view_if_needed()
    start, end = spot(page, "wait 2 s", 0.5), spot(page, "go_to table", 0.1)
    touch("Start", *start)
    expect(page.locator(".dragged")).to_have_count(1)
    touch("Move", start[0], (start[1] + end[1]) / 2)
    touch("Move", *end)
    expect(page.get_by_text("Drop it before go_to table")).to_be_visible()
    shot(page, "drag_phone")
    touch("End")
    expect(page.locator(".cm-line").nth(5)).to_contain_text("wait: 2 s")


@pytest.mark.soak  # who may not configure is tested with the editor
def test_who_may_not_configure_drags_nothing(
    open_page: Callable[..., Page], project: Project, gateway: FakeGateway
) -> None:
    gateway.config = {**gateway.config, "role": "operate"}
    page = edits(open_page(page_name="mission"))
    drags(page, "wait 2 s", "go_to table", 0.1)
    expect(page.locator(".dragged")).to_have_count(0)
    page.mouse.up()


@pytest.mark.soak
def test_blocks_are_folded_by_keys_and_stay_folded_through_edits(page: Page) -> None:
    block(page, "repeat 2").locator(":scope > .outline-row").click()
    page.keyboard.press("ArrowLeft")
    repeat = block(page, "repeat 2")
    expect(repeat).to_have_attribute("aria-expanded", "false")
    expect(page.get_by_role("treeitem")).to_have_count(4)
    page.keyboard.press("Alt+ArrowUp")
    expect(page.locator(".cm-line").nth(6)).to_contain_text("again and again")
    expect(page.get_by_role("treeitem").nth(1)).to_contain_text("repeat 2")
    expect(repeat).to_have_attribute("aria-expanded", "false")
    page.keyboard.press("ArrowDown")
    expect(block(page, "wait 2 s")).to_be_focused()
    page.locator(".editor-text .cm-line", has_text="log: one").click()
    expect(repeat).to_have_attribute("aria-selected", "true")
    page.keyboard.press("End")
    page.keyboard.type("!")
    expect(page.locator(".cm-content")).to_contain_text("log: one!")
    expect(repeat).to_have_attribute("aria-expanded", "false")
    repeat.focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    expect(block(page, "log one!")).to_be_focused()
    page.keyboard.press("ArrowLeft")
    expect(repeat).to_be_focused()
    assert violations(page) == []


@pytest.mark.soak
def test_a_button_folds_and_what_is_moved_into_a_folded_block_is_shown(page: Page) -> None:
    page.get_by_role("button", name="Hide what is in repeat 2").click()
    expect(page.get_by_role("treeitem")).to_have_count(4)
    shot(page, "folded")
    row(page, "log the end").click()
    page.keyboard.press("Alt+ArrowRight")
    expect(block(page, "repeat 2")).to_have_attribute("aria-expanded", "true")
    expect(block(page, "log the end")).to_be_focused()


@pytest.mark.soak
def test_folds_fit_the_window_and_the_finger(page: Page) -> None:
    for size in (WIDE, PHONE):
        page.set_viewport_size(size)
        expect_fit(page)


MACHINE = """rbx: 1
kind: Mission
name: fetch
machine:
  start: away
  states:
    away:
      do:
        go_to: table
      next: {success: home, failure: failed}
    home:
      do:
        go_to: dock
      next: {success: finished, failure: failed}
"""


@pytest.mark.soak  # as a step is added; what it writes needs no browser
def test_a_state_is_added_behind_the_chosen_one_and_given_a_name(
    open_page: Callable[..., Page], project: Project
) -> None:
    project.file.write_text(MACHINE, encoding="utf-8")
    page = edits(open_page(page_name="mission"))
    row(page, "go_to table").click()
    page.get_by_text("Add a step").click()
    page.get_by_role("button", name="Add a state to the mission").click()
    expect(page.get_by_text("Options of state")).to_be_visible()
    name = page.get_by_label("Name What leads to it follows.")
    expect(name).to_have_value("new_state")
    assert violations(page) == []
    shot(page, "parts")
    name.fill("look")
    name.press("Enter")
    expect(page.locator(".cm-content")).to_contain_text("success: look")
    expect(block(page, "look state")).to_have_attribute("aria-selected", "true")
    assert lines(page)[9:14] == [
        "      next: {success: look, failure: failed}",
        "    look:",
        "      do:",
        "        wait: 1 s",
        "      next: home",
    ]
    expect(page.get_by_text("No mistakes")).to_be_visible()
    page.set_viewport_size(PHONE)
    expect_fit(page)


LINES = f"""{FETCH}  - go_to:
      # over there
      pose: dock
  - log: |
      one
      two
"""


@pytest.mark.soak
def test_a_value_of_several_lines_is_edited_in_a_larger_field(open_page: Callable[..., Page], project: Project) -> None:
    project.file.write_text(LINES, encoding="utf-8")
    page = edits(open_page(page_name="mission"))
    row(page, "log one two").click()
    text = page.locator("#option-log")
    expect(text).to_have_value("one\ntwo\n")
    text.fill("one\n  three\n")
    text.press("Control+Enter")
    expect(block(page, "log one three")).to_be_visible()
    assert lines(page)[-4:] == ["  - log: |", "      one", "        three", ""]
    row(page, "go_to pose dock").click()
    expect(page.locator("#option-go_to-pose")).to_have_value("dock")
    assert violations(page) == []
    shot(page, "lines")
    page.set_viewport_size(PHONE)
    expect_fit(page)


@pytest.mark.soak  # the sentences are tested without a browser
def test_the_mission_is_read_aloud_as_it_is_typed_and_a_sentence_chooses_its_block(page: Page) -> None:
    page.get_by_role("button", name="Read", exact=True).click()
    sentences = page.get_by_role("list", name="The mission in sentences")
    expect(sentences.get_by_role("button", name="Wait 2 s")).to_be_visible()
    assert violations(page) == []
    sentences.get_by_role("button", name="Wait 2 s").click()
    expect(block(page, "wait 2 s")).to_have_attribute("aria-selected", "true")
    expect(sentences.get_by_role("button", name="Wait 2 s")).to_have_attribute("aria-current", "true")
    shot(page, "read")
    page.locator("#option-wait").fill("5 s")
    page.locator("#option-wait").press("Enter")
    expect(sentences.get_by_role("button", name="Wait 5 s")).to_be_visible()
    page.locator("#option-wait").fill("5 secs")
    page.locator("#option-wait").press("Enter")
    expect(page.get_by_text("it cannot be read aloud yet")).to_be_visible()
    page.set_viewport_size(PHONE)
    expect_fit(page)


NESTED_MACHINE = """rbx: 1
kind: Mission
name: fetch
machine:
  start: away
  ends: {lost: failure}
  states:
    away:
      do:
        go_to: table
      next: {success: look, failure: lost}
    look:
      machine:
        start: wait_a_while
        states:
          wait_a_while:
            do:
              wait: 1 s
            next: log_it
          log_it:
            do:
              log: done
            next: finished
      next: home
    home:
      do:
        go_to: dock
      next: {success: finished, failure: away}
"""


@pytest.mark.soak
def test_machines_are_drawn_and_a_box_chooses_its_state(open_page: Callable[..., Page], project: Project) -> None:
    project.file.write_text(NESTED_MACHINE, encoding="utf-8")
    page = edits(open_page(page_name="mission"))
    page.get_by_role("button", name="Graph").click()
    machine = page.get_by_label("Machine: The mission")
    expect(machine.get_by_role("button")).to_have_count(3)
    expect(machine.get_by_role("button", name="away start")).to_be_visible()
    expect(machine.locator(".machine-end")).to_have_text(["lostend", "finishedend"])
    expect(machine.get_by_role("img")).to_have_attribute("aria-label", re.compile("away leads to lost after failure"))
    assert violations(page) == []
    machine.get_by_role("button", name="look").click()
    look = page.get_by_role("treeitem").filter(has_text="look state").first
    expect(look).to_have_attribute("aria-selected", "true")
    expect(page.get_by_label("Machine: look").get_by_role("button")).to_have_count(2)
    shot(page, "graph")
    page.get_by_role("button", name="Dry run").click()
    expect(machine.get_by_role("button", name="home")).to_have_attribute("data-status", "success")
    assert violations(page) == []
    shot(page, "graph_run")
    for size in (WIDE, PHONE):
        page.set_viewport_size(size)
        expect_fit(page)
    shot(page, "graph_phone")


@pytest.mark.soak
def test_else_is_added_and_deleted_again(open_page: Callable[..., Page], project: Project) -> None:
    text = f"{FETCH}  - if: 1 > 2\n    then:\n      wait: 3 s\n"
    project.file.write_text(text, encoding="utf-8")
    page = edits(open_page(page_name="mission"))
    row(page, "wait 3 s").click()
    expect(page.get_by_role("button", name="Delete")).to_be_disabled()
    page.get_by_text("Add a step").click()
    page.get_by_role("button", name="Add 'else' to if 1 > 2").click()
    expect(block(page, "else: wait 1 s")).to_have_attribute("aria-selected", "true")
    page.get_by_role("button", name="Delete").click()
    expect(block(page, "else")).to_have_count(0)
    assert "\n".join(lines(page)) == text


@pytest.mark.soak  # as in the tree of the page
def test_the_state_in_which_the_robot_is_stands_out_in_the_graph(
    open_page: Callable[..., Page], project: Project, gateway: FakeGateway
) -> None:
    project.file.write_text(MACHINE, encoding="utf-8")
    robot = project.compiled({}).robot
    picture = picture_of(robot.missions["fetch"].program, robot.names)
    numbers = {one.name or one.role: one.number for one in picture.main.all()}
    seen = {"mission": "fetch", "state": "running", "began": 0.0, "shown": {}, "transitions": []}
    statuses = {str(numbers["home"]): RUNNING}
    look = {**seen, "statuses": statuses, "picture": picture_to_data(picture)}
    gateway.windows["mission/LookAtAll/mission/fetch"] = look
    page = edits(open_page(page_name="mission"))
    page.get_by_role("button", name="Graph").click()
    home = page.get_by_label("Machine: The mission").get_by_role("button", name="home")
    expect(home).to_have_attribute("data-status", "running")
    expect(home).to_have_attribute("title", "home: the robot is in it now")
    assert violations(page) == []
    shot(page, "graph_live")
