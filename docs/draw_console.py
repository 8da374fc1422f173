"""Draws the pages of the console in a browser, light and dark, of robots that run: run `make docs`."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

from playwright.sync_api import Browser, Page, ViewportSize

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent))  # the tests are no package

from tests.console.browser import CHROMIUM, chromium, console  # noqa: E402
from tests.console.fake_gateway import FakeGateway  # noqa: E402
from tests.console.test_page_fleet import says  # noqa: E402

SIZE: ViewportSize = {"width": 1180, "height": 700}
SCHEMES: dict[Literal["light", "dark"], str] = {"light": "", "dark": "_dark"}
POSE = {"x": "12", "y": "-12", "z": "75", "roll": "0", "pitch": "0", "yaw": "0"}  # of a tip [cm, degrees]
RUNNING = 15_000  # [ms] after which the patrol has left a trail


def look(page: Page) -> None:
    """Wait until the page has what the robot says."""
    page.get_by_text("Connected", exact=True).wait_for()
    page.wait_for_timeout(2500)


def drive(page: Page) -> None:
    """Drive a curve to the left with the mouse."""
    page.get_by_text("Connected", exact=True).wait_for()
    page.fill("#name", "Ada")
    page.get_by_role("button", name="OK").click()
    page.locator("drive-pad").hover(position={"x": 200, "y": 100})
    page.mouse.down()
    page.get_by_text("You are driving").wait_for()
    page.wait_for_timeout(600)


def plan(page: Page) -> None:
    """Plan a way for the tip of the arm, whose ghost is shown."""
    look(page)
    page.get_by_role("button", name="Drag its tip").click()
    page.wait_for_timeout(1000)
    for name, value in POSE.items():
        page.fill(f"#tip-right_arm-{name}", value)
    page.get_by_role("button", name="Plan", exact=True).click()
    page.get_by_text("Execute moves the arm").wait_for()
    page.wait_for_timeout(1500)


def whole_world(page: Page) -> None:
    """Show the robot in all of its world."""
    look(page)
    page.get_by_label("World", exact=True).check()
    page.get_by_role("button", name="All of the world").click()
    page.wait_for_timeout(3000)


def plot(page: Page) -> None:
    """Plot where the robot is."""
    look(page)
    page.get_by_role("button", name="/odom").click()
    page.locator('summary[data-path="pose/pose/position"]').click()
    for name in "xy":
        page.locator(f'[data-path="pose/pose/position/{name}"]').click()
    page.wait_for_timeout(RUNNING)
    page.evaluate("scrollTo(0, 0)")


ROBOTS: dict[str, dict[str, Callable[[Page], None]]] = {
    "turtlebot": {
        **dict.fromkeys(("robot", "map", "mission", "parameters", "diagnostics", "mux", "log"), look),
        "data": plot,
    },
    "pi_robot": {"model": plan},
    "house": {"map": look, "model": whole_world},
}
PREFIXES = {"house": "navigation"}  # of the names of pictures, where they are not about the console


def free_port() -> int:
    """Return a port that nothing listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def running(robot: str) -> Iterator[str]:
    """Run a robot and yield the address of its page."""
    port = free_port()
    with tempfile.TemporaryDirectory(prefix="rbx") as folder:
        own = {**os.environ, "XDG_RUNTIME_DIR": folder}
        settings = {"console.port": port, "bus.port": free_port(), "bus.domain": 87}
        words = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
        command = [sys.executable, "-m", "rbxcompose"]
        subprocess.run([*command, "up", f"robots/{robot}", "-d", *words], cwd=DOCS.parent, env=own, check=True)
        try:
            yield f"http://127.0.0.1:{port}/"
        finally:
            subprocess.run([*command, "down", robot], env=own, check=True)


def draw(browser: Browser, url: str, pages: dict[str, Callable[[Page], None]], prefix: str = "console") -> None:
    """Draw pages of one robot."""
    for scheme, suffix in SCHEMES.items():
        for name, prepare in pages.items():
            page = browser.new_page(viewport=SIZE, color_scheme=scheme, device_scale_factor=1.5)
            page.goto(f"{url}#{name}")
            prepare(page)
            page.screenshot(path=DOCS / f"{prefix}_{name}{suffix}.png")
            page.close()


def main() -> None:
    """Draw all pages."""
    if CHROMIUM is None:
        sys.exit("the pictures of the console need chromium")
    console.build()
    gateway, other = FakeGateway(console.STATIC), FakeGateway(console.STATIC)
    gateway.config = gateway.config | {"fleet": {"turtlebot": f":{gateway.port}", "digger": f":{other.port}"}}
    says(gateway, "patrol", 0.0)
    says(other, "dig", 4.0)
    try:
        with chromium() as browser:
            draw(browser, gateway.url, {"fleet": look, "drive": drive})
            for robot, pages in ROBOTS.items():
                with running(robot) as url:
                    waiting = browser.new_page()
                    waiting.wait_for_timeout(RUNNING)
                    waiting.close()
                    draw(browser, url, pages, PREFIXES.get(robot, "console"))
    finally:
        gateway.close()
        other.close()


if __name__ == "__main__":
    main()
