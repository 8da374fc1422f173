"""Priorities of muxes edited on their page in a real browser; behind it, the real editor and a project on disk."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.console.browser import CHROMIUM
from tests.console.edited_robot import EditedProject
from tests.console.fake_gateway import FakeGateway
from tests.console.looks import PHONE, WIDE, expect_fit
from tests.console.test_page_data import has_mux
from tests.robot_editor.test_muxes import MUXED
from tests.soak import rare

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")


@pytest.fixture
def project(gateway: FakeGateway, tmp_path: Path) -> EditedProject:
    has_mux(gateway)
    return EditedProject(gateway, tmp_path, MUXED, {})


def edits(page: Page) -> Locator:
    page.get_by_role("button", name="Edit priorities and timeouts").click()
    panel = page.get_by_role("region", name="Edit priorities")
    expect(panel.get_by_role("group", name="teleop")).to_be_visible()
    return panel


def order(panel: Locator) -> list[str]:
    return panel.locator(".ranked-name strong").all_inner_texts()


def test_inputs_change_places_by_buttons_and_are_saved(open_page: Callable[..., Page], project: EditedProject) -> None:
    page = open_page(page_name="mux")
    panel = edits(page)
    assert order(panel) == ["Door", "Teleop", "Navigation"]
    panel.get_by_role("button", name="Navigation: one place higher").press("Enter")
    expect(panel.get_by_role("group", name="navigation").get_by_label("Priority")).to_have_value("100")
    assert order(panel) == ["Door", "Navigation", "Teleop"]
    expect(panel.get_by_role("button", name="Navigation: one place higher")).to_be_focused()
    panel.get_by_role("group", name="teleop").get_by_label("Timeout").fill("0.25")
    page.keyboard.press("Enter")
    expect(panel.get_by_role("group", name="teleop").get_by_label("Timeout")).to_have_value("0.25 s")
    page.get_by_role("button", name="Save").click()
    dialog = page.get_by_role("dialog")
    expect(dialog.get_by_label("added").first).to_contain_text("priority: 10   # of 255")
    dialog.get_by_role("button", name="Write it").click()
    expect(page.get_by_text("Saved in robots/fetcher/robot.yaml")).to_be_visible()
    after = MUXED.replace("priority: 100 ", "priority: 10 ").replace("go_to, priority: 10,", "go_to, priority: 100,")
    assert project.text() == after.replace("500 ms", "0.25 s")


@pytest.mark.soak
def test_what_is_wrong_is_told_before_it_is_saved(open_page: Callable[..., Page], project: EditedProject) -> None:
    page = open_page(page_name="mux")
    panel = edits(page)
    priority = panel.get_by_role("group", name="navigation").get_by_label("Priority")
    priority.fill("100")
    priority.press("Enter")
    expect(page.get_by_label("Mistakes", exact=True).get_by_role("listitem").first).to_contain_text("by your changes")
    priority.fill("high")
    priority.press("Enter")
    expect(panel.get_by_text("must be a whole number")).to_be_visible()
    timeout = panel.get_by_role("group", name="navigation").get_by_label("Timeout")
    timeout.fill("3 s")
    timeout.press("Enter")
    expect(panel.get_by_text("is computed from")).to_be_visible()
    assert project.text() == MUXED


@pytest.mark.parametrize("size", [PHONE, *rare(WIDE)], ids=["phone", "wide"])
@pytest.mark.soak  # as the editor of missions does
def test_the_editor_fits_and_everyone_can_read_it(
    open_page: Callable[..., Page], project: EditedProject, size: dict[str, int]
) -> None:
    page = open_page(page_name="mux")
    page.set_viewport_size(size)  # type: ignore[arg-type]
    edits(page)
    expect_fit(page)
    if (shots := os.environ.get("SHOTS")) is not None:
        page.screenshot(path=f"{shots}/mux_{size['width']}.png", full_page=True)
    page.get_by_role("button", name="Close").click()
    expect(page.get_by_role("button", name="Edit priorities and timeouts")).to_be_focused()
