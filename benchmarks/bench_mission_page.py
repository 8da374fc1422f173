"""The editor of missions on the console's page: what an edit of a long mission costs, and how it scrolls."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.measuring import COMMAND, Row, Samples, program
from benchmarks.peers import free_port

MEASURES = ("rbxcompose/tools/mission_editor", "console/src")

NODES = 300
LONGEST = 1_000  # nodes of the mission in which a mistake is made
EDITS = 12
SCROLL = 2.0  # [s]
SETTLED = 2_500  # [ms] after an edit, in which it is looked at and checked

MANIFEST = """rbx: 1
kind: Robot
name: benchmark_of_the_editor
bus: {{port: {bus}}}
console: {{port: {port}}}
components:
  base: {{type: diff_drive_sim}}
missions:
  long: long.yaml
"""


def mission(nodes: int) -> str:
    """Return a mission of about so many nodes: steps, loops and choices, nested in one another."""
    lines = ["rbx: 1", "kind: Mission", "name: long", "do:"]
    for number in range(nodes // 6):
        lines += [
            f"  - log: group {number}",
            "  - repeat: 2",
            "    do:",
            f"      - wait: {number + 1} s  # a while",
            f"      - log: waited for {number + 1} s",
            f"      - check: {number} >= 0",
        ]
    return "\n".join([*lines, ""])


@contextmanager
def _console(nodes: int) -> Iterator[str]:
    """Yield the address of a console whose robot has a mission of so many nodes."""
    with TemporaryDirectory() as folder:
        port, base = free_port(), Path(folder)
        (base / "robot.yaml").write_text(MANIFEST.format(port=port, bus=free_port()), encoding="utf-8")
        (base / "long.yaml").write_text(mission(nodes), encoding="utf-8")
        environment = {"XDG_RUNTIME_DIR": folder}
        program([*COMMAND, "up", "-d", folder], environment)()
        try:
            yield f"http://127.0.0.1:{port}/#mission"
        finally:
            program([*COMMAND, "down"], environment)()


_FRAMES = """async (seconds) => {
  const tree = document.querySelector("[role='tree']");
  const times = [];
  let way = 24;
  const began = performance.now();
  await new Promise((resolve) => {
    const step = (now) => {
      times.push(now);
      const before = tree.scrollTop;
      tree.scrollTop += way;
      if (tree.scrollTop === before) way = -way;
      if (now - began < seconds * 1000) requestAnimationFrame(step);
      else resolve();
    };
    requestAnimationFrame(step);
  });
  return times.slice(1).map((time, turn) => time - times[turn]);
}"""


_FINDINGS = """() => {
  const clean = () => document.body.innerText.includes("No mistakes");
  let [pressed, was] = [0, clean()];
  window.delays = [];
  document.addEventListener("keydown", () => { pressed = performance.now(); }, true);
  new MutationObserver(() => {
    if (clean() === was) return;
    was = !was;
    window.delays.push(performance.now() - pressed);
  }).observe(document.body, { subtree: true, childList: true, characterData: true });
}"""


class _Measured:
    """A page, and what Chromium's own counters say of it."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.session = page.context.new_cdp_session(page)
        self.session.send("Performance.enable")

    def scripting(self) -> float:
        """Return how long scripts have run so far [s]."""
        found = self.session.send("Performance.getMetrics")["metrics"]
        return float(next(one["value"] for one in found if one["name"] == "ScriptDuration"))

    def edits(self, act: Any) -> Samples:
        """Return how long scripts run for each of some edits, with all that follows from it [s]."""
        times = []
        for turn in range(EDITS):
            before = self.scripting()
            act(turn)
            self.page.wait_for_timeout(SETTLED)
            times.append(self.scripting() - before)
        return Samples(tuple(times))


@contextmanager
def _editor(nodes: int) -> Iterator[Any]:
    """Yield a page that has a mission of so many nodes open in the editor."""
    from playwright.sync_api import sync_playwright

    with _console(nodes) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.goto(address)
        page.get_by_role("button", name="Edit").click()
        page.get_by_text("No mistakes").wait_for()
        if page.locator("#name").is_visible():
            page.fill("#name", "measured")
            page.keyboard.press("Enter")
        yield page
        browser.close()


def findings() -> Samples:
    """Return the times from a key that makes or mends a mistake until the page says so [ms]."""
    with _editor(LONGEST) as page:
        page.locator(".editor-text .cm-line", has_text="check: 3 >= 0").first.click()
        page.keyboard.press("End")
        page.evaluate(_FINDINGS)
        for turn in range(EDITS):
            page.keyboard.press("x" if turn % 2 == 0 else "Backspace")
            page.wait_for_timeout(SETTLED)
        return Samples(tuple(page.evaluate("window.delays")))


def measured() -> tuple[float, float, Samples]:
    """Return the scripting of an edit in the text and in the outline [s], and the frames of scrolling [ms]."""
    with _editor(NODES) as page:
        looked = _Measured(page)
        page.wait_for_timeout(SETTLED)
        before = looked.scripting()
        page.wait_for_timeout(SETTLED)
        idle = looked.scripting() - before  # of what the page does anyway
        page.locator(".editor-text .cm-line", has_text="group 3").click()
        page.keyboard.press("End")
        typed = looked.edits(lambda turn: page.keyboard.type("x"))
        page.get_by_role("treeitem").filter(has_text="group 2").last.focus()
        page.keyboard.press("Home")
        moved = looked.edits(lambda turn: page.keyboard.press("Alt+ArrowDown" if turn % 2 == 0 else "Alt+ArrowUp"))
        frames = Samples(tuple(page.evaluate(_FRAMES, SCROLL)))
    return typed.median - idle, moved.median - idle, frames


def rows() -> list[Row]:
    """Return the figures of the editor; nothing without a browser."""
    if shutil.which("chromium") is None:
        return []
    typed, moved, frames = measured()
    found = findings()
    how = f"a mission of {NODES} nodes, with all that follows from it"
    return [
        Row("editor of missions: scripting of a key in the text", "ms", how, typed * 1e3, most=16),
        Row("editor of missions: scripting of a move in the outline", "ms", how, moved * 1e3, most=16),
        Row(
            "editor of missions: frame while it scrolls",
            "ms",
            f"a mission of {NODES} nodes",
            frames.median,
            frames.p99,
            most=17,
        ),
        Row(
            "editor of missions: findings of a key in the text",
            "ms",
            f"a mission of {LONGEST} nodes, from the key until the page says so",
            found.median,
            found.p99,
            most=200,
        ),
    ]
