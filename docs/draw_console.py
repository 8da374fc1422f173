"""Draws the pages of the console in a browser, light and dark, with what a fake gateway says: run `make docs`."""

from __future__ import annotations

import sys
from pathlib import Path

from playwright.sync_api import Page

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent))  # the tests are no package

from tests.console.browser import CHROMIUM, chromium, console  # noqa: E402
from tests.console.fake_gateway import FakeGateway  # noqa: E402

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


def main() -> None:
    """Draw all pages."""
    if CHROMIUM is None:
        sys.exit("the pictures of the console need chromium")
    console.build()
    gateway = FakeGateway(console.STATIC)
    try:
        with chromium() as browser:
            for scheme, suffix in SCHEMES.items():
                page = browser.new_page(viewport=SIZE, color_scheme=scheme, device_scale_factor=1.5)
                page.goto(gateway.url)
                drive(page)
                page.screenshot(path=DOCS / f"console_drive{suffix}.png")
                page.close()
    finally:
        gateway.close()


if __name__ == "__main__":
    main()
