"""The page of the console in a browser, beside a fake gateway."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, ConsoleMessage, Error, Page, Request, ViewportSize, expect

from tests.console.browser import chromium, console
from tests.console.fake_gateway import FakeGateway
from tests.console.looks import WIDE

_UNTIL_LAST = ExitStack()
HELD = ("Shift", "ArrowUp")  # keys that tests hold down


@pytest.fixture(scope="session")
def static() -> Path:
    try:
        console.build()
    except console.CannotBuildError as error:
        pytest.skip(str(error))
    static: Path = console.STATIC
    return static


@pytest.fixture
def gateway(static: Path) -> Iterator[FakeGateway]:
    gateway = FakeGateway(static)
    yield gateway
    gateway.close()


class Pages:
    """A page of the browser for each kind of window: to open one that is there takes a quarter of a new one's time."""

    def __init__(self, browser: Browser) -> None:
        self.browser = browser
        self.pages: dict[str, Page] = {}

    def blank(self, **options: Any) -> Page:
        """Return a page with nothing in it, without a key or a button held down, in a window of the usual size."""
        kind = str(options)
        if kind not in self.pages:
            self.pages[kind] = self.browser.new_context(**options).new_page()
        page = self.pages[kind]
        if page.url != "about:blank":
            page.goto("about:blank")
        for key in HELD:
            page.keyboard.up(key)
        page.mouse.up()
        page.mouse.move(0, 0)
        return page


@cache
def shared_pages() -> Pages:
    return Pages(_UNTIL_LAST.enter_context(chromium()))


@pytest.fixture
def pages(static: Path) -> Pages:
    return shared_pages()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(nextitem: pytest.Item | None) -> Generator[None]:
    """End the browser with the last test of the page: its event loop must be gone before other tests have theirs."""
    try:
        yield
    finally:
        if nextitem is None or not nextitem.path.name.startswith("test_page"):
            shared_pages.cache_clear()
            _UNTIL_LAST.close()


@pytest.fixture
def open_page(pages: Pages, gateway: FakeGateway) -> Iterator[Callable[..., Page]]:
    """Return a function that opens the console; no page may complain or ask another host for anything."""
    opened: list[Page] = []
    complaints: list[str] = []
    known = [gateway.url]

    def tell(message: ConsoleMessage) -> None:
        complaints.append(message.text)

    def fail(error: Error) -> None:
        complaints.append(str(error))

    def look_at(request: Request) -> None:
        if not request.url.startswith(tuple(known)):
            complaints.append(request.url)

    def open_page(
        name: str = "Ada",
        page_name: str = "",
        foreign: Sequence[str] = (),
        viewport: ViewportSize = WIDE,
        **options: Any,
    ) -> Page:
        known.extend(foreign)
        page = pages.blank(**options)
        page.set_viewport_size(viewport)
        page.set_default_timeout(10_000)
        page.on("console", tell)
        page.on("pageerror", fail)
        page.on("request", look_at)
        opened.append(page)
        page.goto(f"{gateway.url}#{page_name}")
        expect(page.locator(".connection")).to_contain_text("Connected")
        if name and page.locator("#name").is_visible():
            page.fill("#name", name)
            page.keyboard.press("Enter")
            page.keyboard.up("Enter")
        return page

    yield open_page
    for page in opened:
        page.remove_listener("console", tell)
        page.remove_listener("pageerror", fail)
        page.remove_listener("request", look_at)
        page.goto("about:blank")
    # What a screenshot of a picture in 3D costs is the driver's complaint, and who is locked out is the gateway's.
    expected = ("WebSocket", "GL Driver Message", "401 (Unauthorized)")
    assert [text for text in complaints if not any(words in text for words in expected)] == []
