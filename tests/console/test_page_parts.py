"""Parts edited on the page of the model in a real browser; behind it, the real editor and a project on disk."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Picture
from playwright.sync_api import Locator, Page, expect

from rbxcompose.compiler.compile import compile_robot
from rbxcompose.domains.body.sections.body import body
from tests.console.browser import CHROMIUM
from tests.console.edited_robot import EditedProject
from tests.console.fake_gateway import FakeGateway
from tests.console.looks import PHONE, WIDE, expect_fit, violations
from tests.console.test_page_robot import DESCRIBED
from tests.robot_editor.test_parts import BUILT, POLE
from tests.soak import rare

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")


@pytest.fixture
def project(gateway: FakeGateway, tmp_path: Path) -> EditedProject:
    made = EditedProject(gateway, tmp_path, BUILT, {"parts/pole.yaml": POLE})
    robot = compile_robot(str(made.robot), environment=os.environ).robot
    assert robot is not None
    found = robot.manifest.contents.of(body)
    assert found is not None
    gateway.files["/console/model.urdf"] = found.published.encode()
    gateway.windows[DESCRIBED] = []
    return made


def edits(page: Page) -> Locator:
    page.get_by_role("button", name="Edit parts").click()
    panel = page.get_by_role("region", name="Edit parts")
    expect(panel.get_by_role("button", name="Torso", exact=True)).to_be_visible()
    return panel


def ghosts(page: Page) -> list[str]:
    found: list[str] = json.loads(page.locator(".scene").get_attribute("data-draft") or "[]")
    return found


def orange(page: Page) -> int:
    """Return how many pixels of the picture have the colour of a ghost."""
    shown = np.asarray(Picture.open(BytesIO(page.locator(".scene").screenshot())).convert("RGB")).astype(int)
    return int(((shown[..., 0] > shown[..., 2] + 60) & (shown[..., 0] > shown[..., 1] + 15)).sum())


def shows(page: Page, name: str) -> None:
    if (shots := os.environ.get("SHOTS")) is not None:
        page.screenshot(path=f"{shots}/{name}.png", full_page=True)


def test_a_part_is_found_seen_as_a_ghost_moved_and_saved(
    open_page: Callable[..., Page], project: EditedProject
) -> None:
    page = open_page(page_name="model")
    panel = edits(page)
    before = orange(page)
    panel.get_by_text("Add a part").click()
    panel.get_by_label("Find a part").fill("depth camera xtion")
    panel.get_by_role("button", name="Xtion").click()
    form = panel.get_by_role("form", name="The new part")
    form.get_by_label("Name").fill("eye")
    form.get_by_label("Attached to").select_option("base_top")
    assert violations(page) == []
    shows(page, "parts_new")
    form.get_by_role("button", name="Show it on the robot").press("Enter")
    expect(panel.get_by_role("button", name="Eye", exact=True)).to_have_attribute("aria-pressed", "true")
    assert ghosts(page)
    assert all(link.startswith("eye_") for link in ghosts(page))
    z = panel.get_by_label("Z", exact=True)
    z.fill("0.3")
    z.press("Enter")
    expect(z).to_have_value("0.3 m")
    assert orange(page) > before + 50
    shows(page, "parts_ghost")
    assert project.text() == BUILT
    page.get_by_role("button", name="Save").click()
    page.get_by_role("dialog").get_by_role("button", name="Write it").click()
    expect(page.get_by_text("Saved in robots/fetcher/robot.yaml")).to_be_visible()
    line = "  eye: {part: rbx:parts/xtion.yaml, attach: {to: base_top, at: {z: 0.3 m}}}\n"
    assert project.text() == BUILT + line


@pytest.mark.soak
def test_a_part_is_attached_elsewhere_and_what_it_carries_goes_along(
    open_page: Callable[..., Page], project: EditedProject
) -> None:
    page = open_page(page_name="model")
    panel = edits(page)
    panel.get_by_role("button", name="Torso", exact=True).click()
    yaw = panel.get_by_label("Yaw")
    yaw.fill("30")
    yaw.press("Enter")
    expect(yaw).to_have_value("30 deg")
    assert {"torso_top", "camera_link"} <= set(ghosts(page))
    yaw.fill("30 m")
    yaw.press("Enter")
    expect(panel.get_by_text("must be an angle")).to_be_visible()
    page.get_by_role("button", name="Undo").click()
    expect(yaw).to_have_value("0 deg")
    assert ghosts(page) == []


@pytest.mark.soak
def test_a_part_is_moved_by_its_arrows(open_page: Callable[..., Page], project: EditedProject) -> None:
    page = open_page(page_name="model")
    panel = edits(page)
    panel.get_by_role("button", name="Camera", exact=True).click()
    z = panel.get_by_label("Z", exact=True)
    expect(z).to_have_value("0 m")
    page.evaluate("() => window.scrollTo(0, 0)")
    box = page.locator(".scene").bounding_box()
    assert box
    shown = np.asarray(Picture.open(BytesIO(page.locator(".scene").screenshot())).convert("RGB")).astype(int)
    rows, columns = np.nonzero((shown[..., 2] > 200) & (shown[..., 0] < 80) & (shown[..., 1] < 80))
    top = rows.argmin()  # of the arrow that points up
    tip = (box["x"] + float(columns[top]), box["y"] + float(rows[top]) + 4)
    page.mouse.move(*tip)
    page.mouse.down()
    page.mouse.move(tip[0], tip[1] - 20)
    page.mouse.move(tip[0], tip[1] - 40)
    page.mouse.up()
    expect(z).to_have_value(re.compile(r"0\.\d+ m|\d+(\.\d)? (cm|mm)"))
    expect(panel.get_by_label("X", exact=True)).to_have_value("0 m")
    assert set(ghosts(page)) >= {"camera_link"}


@pytest.mark.soak
def test_a_part_that_carries_another_is_deleted_and_that_is_said(
    open_page: Callable[..., Page], project: EditedProject
) -> None:
    page = open_page(page_name="model")
    panel = edits(page)
    panel.get_by_role("button", name="Torso", exact=True).click()
    panel.get_by_role("button", name="Delete this part").click()
    expect(page.get_by_label("Mistakes", exact=True).get_by_role("listitem").first).to_contain_text("torso_top")
    page.get_by_role("button", name="Close", exact=True).click()
    expect(page.get_by_role("button", name="Edit parts")).to_be_focused()
    edits_again = page.get_by_role("button", name="Edit parts")
    edits_again.click()
    page.get_by_role("button", name="Undo").click()
    expect(page.get_by_text("1 warning", exact=True)).to_be_visible()  # which was there before
    assert project.text() == BUILT


@pytest.mark.soak
def test_what_a_part_needs_is_asked_for(open_page: Callable[..., Page], project: EditedProject) -> None:
    page = open_page(page_name="model")
    panel = edits(page)
    panel.get_by_text("Add a part").click()
    panel.get_by_label("Find a part").fill("pole")
    panel.get_by_role("button", name="Pole").click()
    panel.get_by_label("Height").fill("80 cm")
    panel.get_by_role("button", name="Show it on the robot").click()
    expect(panel.get_by_role("button", name="Pole", exact=True)).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_text("1 warning", exact=True)).to_be_visible()  # which was there before


@pytest.mark.parametrize("size", [PHONE, *rare(WIDE)], ids=["phone", "wide"])
@pytest.mark.soak  # as the editor of missions does
def test_the_editor_fits_and_everyone_can_read_it(
    open_page: Callable[..., Page], project: EditedProject, size: dict[str, int]
) -> None:
    page = open_page(page_name="model")
    page.set_viewport_size(size)  # type: ignore[arg-type]
    panel = edits(page)
    panel.get_by_role("button", name="Torso", exact=True).click()
    expect_fit(page)
    panel.get_by_text("Add a part").click()
    expect(panel.get_by_role("button", name="Xtion")).to_be_visible()
    expect_fit(page)
    shows(page, f"parts_{size['width']}")
