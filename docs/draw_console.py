"""Draws the pages of the console in a browser, light and dark, with what a fake gateway says: run `make docs`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Page

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent))  # the tests are no package

from tests.console.browser import CHROMIUM, chromium, console  # noqa: E402
from tests.console.fake_gateway import FakeGateway  # noqa: E402
from tests.console.test_page_fleet import says  # noqa: E402
from tests.console.test_page_mission import LOOK_AT, TREE, listed, seen, tree  # noqa: E402

SIZE = {"width": 1180, "height": 700}
SCHEMES = {"light": "", "dark": "_dark"}


def drive(page: Page) -> None:
    """Drive a curve to the left with the mouse."""
    page.get_by_text("Connected", exact=True).wait_for()
    page.fill("#name", "Ada")
    page.get_by_role("button", name="OK").click()
    page.locator("drive-pad").hover(position={"x": 200, "y": 100})
    page.mouse.down()
    page.get_by_text("You are driving").wait_for()
    page.wait_for_timeout(600)


def look(page: Page) -> None:
    """Wait until the page has what the gateway says."""
    page.get_by_text("Connected", exact=True).wait_for()
    page.wait_for_timeout(1500)


PAGES: dict[str, Callable[[Page], None]] = {"drive": drive, "mission": look, "diagnostics": look, "fleet": look}


def main() -> None:
    """Draw all pages."""
    if CHROMIUM is None:
        sys.exit("the pictures of the console need chromium")
    console.build()
    gateway, other = FakeGateway(console.STATIC), FakeGateway(console.STATIC)
    gateway.config = gateway.config | {"fleet": {"turtlebot": f":{gateway.port}", "digger": f":{other.port}"}}
    says(gateway, "patrol", 0.0)
    says(other, "dig", 4.0)
    gateway.windows |= {
        "mission/ListMissions": listed("running"),
        LOOK_AT: seen("running", {"0": 1, "1": 1}),
        TREE: tree(2),
    }
    gateway.answers["diagnostics.ListChanges"] = lambda _: []
    try:
        with chromium() as browser:
            for scheme, suffix in SCHEMES.items():
                for name, prepare in PAGES.items():
                    page = browser.new_page(viewport=SIZE, color_scheme=scheme, device_scale_factor=1.5)
                    page.goto(f"{gateway.url}#{name}")
                    prepare(page)
                    page.screenshot(path=DOCS / f"console_{name}{suffix}.png")
                    page.close()
    finally:
        gateway.close()
        other.close()


if __name__ == "__main__":
    main()
