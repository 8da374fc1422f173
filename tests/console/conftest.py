"""The page of the console in a browser, beside a fake gateway."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Request, expect

from tests.console.browser import chromium, console
from tests.console.fake_gateway import FakeGateway
from tests.console.looks import WIDE


@pytest.fixture(scope="session")
def static() -> Path:
    try:
        console.build()
    except console.CannotBuildError as error:
        pytest.skip(str(error))
    static: Path = console.STATIC
    return static


@pytest.fixture(scope="module")  # its event loop must be gone before tests of other modules have theirs
def browser(static: Path) -> Iterator[Browser]:
    with chromium() as browser:
        yield browser


@pytest.fixture
def gateway(static: Path) -> Iterator[FakeGateway]:
    gateway = FakeGateway(static)
    yield gateway
    gateway.close()


@pytest.fixture
def open_page(browser: Browser, gateway: FakeGateway) -> Iterator[Callable[..., Page]]:
    """Return a function that opens the console; no page may complain or ask another host for anything."""
    contexts: list[BrowserContext] = []
    complaints: list[str] = []

    def open_page(name: str = "Ada", page_name: str = "", foreign: Sequence[str] = (), **options: Any) -> Page:
        known = (gateway.url, *foreign)

        def look_at(request: Request) -> None:
            if not request.url.startswith(known):
                complaints.append(request.url)

        context = browser.new_context(**({"viewport": WIDE} | options))
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(10_000)
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("request", look_at)
        page.goto(f"{gateway.url}#{page_name}")
        expect(page.locator(".connection")).to_have_text("Connected")
        if name and page.locator("#name").is_visible():
            page.fill("#name", name)
            page.keyboard.press("Enter")
            page.keyboard.up("Enter")
        return page

    yield open_page
    for context in contexts:
        context.close()
    # What a screenshot of a picture in 3D costs is the driver's complaint, not the page's.
    assert [text for text in complaints if "WebSocket" not in text and "GL Driver Message" not in text] == []
