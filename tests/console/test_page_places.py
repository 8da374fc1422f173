"""Places edited on the page of the map in a real browser; behind it, the real editor and a project on disk."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.console.browser import CHROMIUM
from tests.console.edited_robot import EditedProject
from tests.console.fake_gateway import FakeGateway
from tests.console.looks import PHONE, WIDE, expect_fit, violations
from tests.console.test_page_map import at, drag, move_fingers, rolls
from tests.robot_editor.test_robot_editor import FETCH
from tests.soak import rare

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")

ROBOT = """# A robot that fetches
rbx: 1
kind: Robot
name: fetcher
places:
  # where it charges
  dock: {x: 0 m, y: 0 m}   # below the window
  window_seat: {x: 1 m, y: 50 cm, heading: 90 deg}
include:
  base: rbx:parts/base.yaml
  nav: rbx:parts/navigation.yaml
missions:
  fetch: ../../missions/fetch.yaml
"""


@pytest.fixture
def project(gateway: FakeGateway, tmp_path: Path) -> EditedProject:
    rolls(gateway)
    return EditedProject(
        gateway, tmp_path, ROBOT, {"missions/fetch.yaml": FETCH.replace("go_to: table", "go_to: window_seat")}
    )


def edits(page: Page) -> Locator:
    page.get_by_role("button", name="Edit places").click()
    panel = page.get_by_role("region", name="Edit places")
    expect(panel.get_by_role("button", name="Window seat")).to_be_visible()
    return panel


def saves(page: Page) -> None:
    page.get_by_role("button", name="Save").click()
    page.get_by_role("dialog").get_by_role("button", name="Write it").click()
    expect(page.get_by_text("Saved in robots/fetcher/robot.yaml")).to_be_visible()


def shows(page: Page, name: str) -> None:
    if (shots := os.environ.get("SHOTS")) is not None:
        page.screenshot(path=f"{shots}/{name}.png", full_page=True)


def test_a_place_is_moved_and_turned_by_hand_and_saved_with_all_comments(
    open_page: Callable[..., Page], project: EditedProject
) -> None:
    page = open_page(page_name="map")
    expect(page.get_by_text("Drag or arrow keys move the view")).to_be_visible()
    panel = edits(page)
    expect(page.get_by_text("arrow keys")).to_have_count(1)  # without regard to case: they move the place
    drag(page, at(page, 0.0, 0.0), at(page, 0.5, -0.25))
    expect(panel.get_by_label("x", exact=True)).to_have_value("0.5 m")
    expect(panel.get_by_label("y", exact=True)).to_have_value(re.compile(r"-0.25 m|-25 cm"))
    x, y = at(page, 0.5, -0.25)
    drag(page, (x + 52, y), (x, y - 80))
    expect(panel.get_by_label("Heading")).to_have_value("90 deg")
    shows(page, "places")
    page.get_by_role("button", name="Save").click()
    dialog = page.get_by_role("dialog")
    expect(dialog.get_by_label("added").first).to_contain_text("heading: 90 deg")
    assert violations(page) == []
    shows(page, "places_save")
    dialog.get_by_role("button", name="Not now").click()
    assert project.text() == ROBOT
    saves(page)
    before, after = ROBOT.split("\n"), project.text().split("\n")
    assert [line for line in after if line not in before] == [
        "  dock: {x: 0.5 m, y: -0.25 m, heading: 90 deg}   # below the window"
    ]
    expect(page.get_by_text("The robot runs without what is saved: mission would be changed live.")).to_be_visible()


@pytest.mark.soak
def test_what_was_saved_is_brought_to_the_robot_that_runs_and_taken_back(
    open_page: Callable[..., Page], project: EditedProject
) -> None:
    page = open_page(page_name="map")
    edits(page)
    drag(page, at(page, 0.0, 0.0), at(page, 0.5, 0.0))
    saves(page)
    page.get_by_role("button", name="Change the running robot").click()
    dialog = page.get_by_role("dialog")
    expect(dialog.get_by_role("list", name="What happens to what runs")).to_have_text(
        "mission patrol goes on where it is"
    )
    assert violations(page) == []
    shows(page, "places_apply")
    dialog.get_by_role("button", name="Change it").click()
    expect(page.get_by_text("The robot is changed.")).to_be_visible()
    assert project.live.runs_with == project.text() != ROBOT
    page.get_by_role("button", name="Take it back").click()
    expect(page.get_by_text("The robot runs as before; the files stay as they are.")).to_be_visible()
    assert project.live.runs_with == ROBOT != project.text()


@pytest.mark.soak
def test_why_the_robot_cannot_be_changed_now_is_told(open_page: Callable[..., Page], project: EditedProject) -> None:
    project.live.why_not = "'base' moves"
    page = open_page(page_name="map")
    edits(page)
    drag(page, at(page, 0.0, 0.0), at(page, 0.5, 0.0))
    saves(page)
    expect(page.get_by_text("Not now: 'base' moves.")).to_be_visible()
    expect(page.get_by_role("button", name="Change the running robot")).to_be_disabled()
    project.live.why_not = ""
    page.get_by_role("button", name="Look again").click()
    expect(page.get_by_text("Not now")).to_be_hidden()
    expect(page.get_by_role("button", name="Change the running robot")).to_be_enabled()


@pytest.mark.soak
def test_a_finger_moves_and_adds_places_as_well(open_page: Callable[..., Page], project: EditedProject) -> None:
    page = open_page(page_name="map", has_touch=True)
    panel = edits(page)
    move_fingers(page, [at(page, 0.02, 0.02)], [at(page, 0.52, 0.52)])
    expect(panel.get_by_label("x", exact=True)).to_have_value("0.5 m")
    move_fingers(page, [at(page, 0.0, 0.5)], [at(page, 0.0, 1.0)])
    expect(panel.get_by_label("Heading")).to_have_value("90 deg")
    expect(panel.get_by_role("button", name="Place 1")).to_have_attribute("aria-pressed", "true")


@pytest.mark.soak
def test_without_a_way_to_the_map_no_drag_moves_a_place(
    open_page: Callable[..., Page], project: EditedProject, gateway: FakeGateway
) -> None:
    gateway.latched = {}
    page = open_page(page_name="map")
    expect(page.get_by_text("in odom")).to_be_visible()
    panel = edits(page)
    drag(page, at(page, 0.0, 0.0), at(page, 0.5, 0.0))
    expect(page.get_by_text("write their numbers instead")).to_be_visible()
    expect(panel.get_by_role("button", name="Undo")).to_be_disabled()


@pytest.mark.soak  # as one is moved by a drag
def test_a_place_is_added_by_a_drag_and_gets_a_name(open_page: Callable[..., Page], project: EditedProject) -> None:
    page = open_page(page_name="map")
    panel = edits(page)
    drag(page, at(page, 0.5, 0.5), at(page, 0.5, 1.0))
    name = panel.get_by_label("Name")
    expect(name).to_be_focused()
    name.fill("shelf")
    name.press("Enter")
    expect(panel.get_by_role("button", name="Shelf")).to_have_attribute("aria-pressed", "true")
    page.get_by_role("button", name="Undo").click()
    expect(panel.get_by_role("button", name="Place 1")).to_be_visible()
    page.get_by_role("button", name="Redo").click()
    saves(page)
    assert "  shelf: {x: 0.5 m, y: 0.5 m, heading: 90 deg}\n" in project.text()


@pytest.mark.soak  # as in the outline of a mission
def test_keys_alone_suffice(open_page: Callable[..., Page], project: EditedProject) -> None:
    page = open_page(page_name="map")
    panel = edits(page)
    panel.get_by_role("button", name="Dock").press("Enter")
    page.locator("map-canvas canvas").focus()
    for key in ("ArrowRight", "ArrowRight", "ArrowUp", "Shift+ArrowDown", "PageUp"):
        page.keyboard.press(key)
    expect(panel.get_by_label("x", exact=True)).to_have_value("0.1 m")
    expect(panel.get_by_label("y", exact=True)).to_have_value("0.04 m")
    expect(panel.get_by_label("Heading")).to_have_value("5 deg")
    panel.get_by_label("x", exact=True).fill("75 cm")
    panel.get_by_label("x", exact=True).press("Enter")
    expect(panel.get_by_label("x", exact=True)).to_have_value("75 cm")
    page.get_by_role("button", name="Save").press("Enter")
    page.get_by_role("dialog").get_by_role("button", name="Write it").press("Enter")
    expect(page.get_by_text("Saved in")).to_be_visible()
    assert "dock: {x: 75 cm, y: 0.04 m, heading: 5 deg}" in project.text()


@pytest.mark.soak
def test_a_mission_that_uses_a_deleted_place_is_named(open_page: Callable[..., Page], project: EditedProject) -> None:
    page = open_page(page_name="map")
    panel = edits(page)
    panel.get_by_role("button", name="Window seat").click()
    panel.get_by_role("button", name="Delete this place").click()
    row = page.get_by_label("Mistakes", exact=True).get_by_role("listitem").first
    expect(row).to_contain_text("there is no place 'window_seat'")
    expect(row).to_contain_text("missions/fetch.yaml:5")
    assert violations(page) == []
    shows(page, "places_finding")
    page.get_by_role("button", name="Undo").click()
    expect(page.get_by_text("No mistakes")).to_be_visible()


@pytest.mark.soak
def test_many_mistakes_can_be_read_by_keys(open_page: Callable[..., Page], project: EditedProject) -> None:
    mission = project.folder / "missions/fetch.yaml"
    mission.write_text(project.text("missions/fetch.yaml") + "  - go_to: window_seat\n" * 20, encoding="utf-8")
    page = open_page(page_name="map", viewport=PHONE)
    panel = edits(page)
    panel.get_by_role("button", name="Window seat").click()
    panel.get_by_role("button", name="Delete this place").click()
    expect(page.get_by_label("Mistakes", exact=True).get_by_role("listitem").first).to_be_visible()
    expect_fit(page)
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_role("dialog")).to_contain_text("the robot does not come up with it")
    expect_fit(page)
    shows(page, "places_many")


@pytest.mark.parametrize(
    ("label", "text", "why"),
    [
        ("x", "NaN m", "must be a length"),
        ("Name", "window_seat", "it is taken"),
        ("x", "1e300", "must be a length"),
        ("x", "9999999 m", "farther away"),
        ("Heading", "3 m", "must be an angle"),
        ("Name", "Big Table!", "cannot be the name of a place"),
    ],
)
@pytest.mark.soak  # the editor refuses it without a browser
def test_what_is_no_value_is_refused_and_stays_to_be_corrected(
    open_page: Callable[..., Page], project: EditedProject, label: str, text: str, why: str
) -> None:
    page = open_page(page_name="map")
    panel = edits(page)
    panel.get_by_role("button", name="Dock").click()
    field = panel.get_by_label(label, exact=True)
    field.fill(text)
    field.press("Enter")
    expect(panel.get_by_text(why)).to_be_visible()
    expect(field).to_have_attribute("aria-invalid", "true")
    expect(field).to_have_value(text)
    expect(page.get_by_role("button", name="Save")).to_be_disabled()
    assert project.text() == ROBOT


@pytest.mark.soak
def test_a_file_that_others_changed_is_loaded_again_with_ones_own_changes(
    open_page: Callable[..., Page], project: EditedProject
) -> None:
    page = open_page(page_name="map")
    panel = edits(page)
    drag(page, at(page, 0.0, 0.0), at(page, 0.5, 0.0))
    expect(panel.get_by_label("x", exact=True)).to_have_value("0.5 m")
    theirs = ROBOT.replace("50 cm", "70 cm")
    project.robot.write_text(theirs, encoding="utf-8")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_text("has changed on disk")).to_be_visible()
    assert project.text() == theirs
    page.get_by_role("button", name="Load it again").click()
    expect(page.get_by_text("with your changes")).to_be_visible()
    saves(page)
    assert project.text() == theirs.replace("dock: {x: 0 m", "dock: {x: 0.5 m")


@pytest.mark.soak
def test_after_a_connection_was_lost_in_a_save_it_is_told_what_became_of_it(
    open_page: Callable[..., Page], project: EditedProject
) -> None:
    page = open_page(page_name="map")
    panel = edits(page)
    drag(page, at(page, 0.0, 0.0), at(page, 0.5, 0.0))
    expect(panel.get_by_label("x", exact=True)).to_have_value("0.5 m")
    project.loses_saves = True
    page.get_by_role("button", name="Save").click()
    page.get_by_role("dialog").get_by_role("button", name="Write it").click()
    expect(page.get_by_text("The connection is back: it was saved.")).to_be_visible(timeout=15_000)
    assert "dock: {x: 0.5 m" in project.text()


@pytest.mark.soak  # who may only look is tested with the mux
def test_who_does_not_configure_sees_no_editor(
    open_page: Callable[..., Page], project: EditedProject, gateway: FakeGateway
) -> None:
    gateway.config = {**gateway.config, "role": "operate"}
    page = open_page(page_name="map")
    expect(page.get_by_role("button", name="Measure")).to_be_visible()
    expect(page.get_by_role("button", name="Edit places")).to_be_hidden()


@pytest.mark.parametrize("size", [PHONE, *rare(WIDE)], ids=["phone", "wide"])
@pytest.mark.soak  # as the editor of missions does
def test_the_editor_fits_and_everyone_can_read_it(
    open_page: Callable[..., Page], project: EditedProject, size: dict[str, int]
) -> None:
    long_name = f"  {'x' * 60}: {{x: 2 m, y: 0 m}}\n"
    project.robot.write_text(ROBOT.replace("include:", f"{long_name}include:"), encoding="utf-8")
    page = open_page(page_name="map")
    page.set_viewport_size(size)  # type: ignore[arg-type]
    panel = edits(page)
    panel.get_by_role("button", name="Window seat").click()
    expect_fit(page)
    shows(page, f"places_{size['width']}")
    page.get_by_role("button", name="Close").click()
    expect(page.get_by_role("region", name="Places")).to_be_visible()
