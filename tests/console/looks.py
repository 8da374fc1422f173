"""What every page of the console keeps: it fits a phone, fingers hit its controls, and everyone can read it."""

from __future__ import annotations

import json

from playwright.sync_api import Page, ViewportSize

from tests.console.browser import AXE

WIDE, PHONE = ViewportSize(width=1280, height=800), ViewportSize(width=390, height=844)
SMALLEST = 44  # [px] of what a finger touches
_TOO_SMALL = """smallest => [...document.querySelectorAll("button, input, a")]
    .map(element => [element.outerHTML, element.getBoundingClientRect()])
    .filter(([, box]) => box.width > 0 && (box.width < smallest || box.height < smallest))
    .map(([html]) => html)"""


def too_small(page: Page) -> list[str]:
    """Return the controls that a finger misses."""
    found: list[str] = page.evaluate(_TOO_SMALL, SMALLEST)
    return found


def overflows(page: Page) -> bool:
    """Return whether the page is wider than its window."""
    return bool(page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth"))


def violations(page: Page, *rules: str) -> list[str]:
    """Return what axe-core finds wrong with the page as it is, by all of its rules or by some."""
    if not page.evaluate("'axe' in window"):
        page.evaluate(f"() => {{{AXE.read_text(encoding='utf-8')}}}")
    how = {"resultTypes": ["violations"], **({"runOnly": rules} if rules else {})}
    found = page.evaluate("how => axe.run(how).then(({violations}) => violations)", how)
    return [f"{violation['id']}: {json.dumps([node['html'] for node in violation['nodes']])}" for violation in found]


def expect_readable(page: Page) -> None:
    """Expect a page that everyone can read, in light and, where colours are all that differs, in dark."""
    page.emulate_media(color_scheme="dark")
    assert violations(page, "color-contrast") == []
    page.emulate_media(color_scheme="light")
    assert violations(page) == []


def expect_fit(page: Page) -> None:
    """Expect a page that fits its window, and the finger, and that everyone can read."""
    assert not overflows(page)
    assert too_small(page) == []
    expect_readable(page)
