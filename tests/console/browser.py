"""Debian's Chromium without a window, and the built page of the console."""

from __future__ import annotations

import importlib.util
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, sync_playwright

ROOT = Path(__file__).parents[2]
AXE = ROOT / "console/node_modules/axe-core/axe.min.js"
CHROMIUM = shutil.which("chromium-headless-shell") or shutil.which("chromium")  # which draws windows as well
_QUIET = ("quic", "background-networking", "component-update", "sync", "gpu")
_SHORT_LIVED = "--js-flags=--single-threaded --no-opt --no-maglev"  # no page lives as long as optimising it pays
_ARGUMENTS = ["--no-sandbox", "--no-first-run", _SHORT_LIVED, *(f"--disable-{name}" for name in _QUIET)]


def _load_build() -> Any:
    spec = importlib.util.spec_from_file_location("console_build", ROOT / "console/build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


console = _load_build()
"""The module that builds the page."""


@contextmanager
def chromium() -> Iterator[Browser]:
    """Yield a browser."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=_ARGUMENTS)
        yield browser
        browser.close()
