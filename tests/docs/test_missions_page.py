"""The page for authors of missions: who follows it sees what it tells, and no kind of step is left out."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from rbxcompose.cli import main as command
from rbxcompose.missions.registry import kinds
from rbxcompose.testing import check_file
from tests.docs.examples import ROOT, blocks_of, is_walked_through

TEXT = (ROOT / "docs/missions.md").read_text(encoding="utf-8")
WALK = list(blocks_of(TEXT.partition("## 4.")[0], "missions.md"))
ROBOT = "robots/cart/robot.yaml"
SKIPS = "..."


def see(shown: str, wanted: str) -> None:
    """Find lines in their order; what `...` stands for may lie between."""
    at = 0
    for line in wanted.splitlines():
        if line != SKIPS:
            found = shown.find(line, at)
            assert found >= 0, f"'{line}' does not come in\n{shown[at:]}"
            at = found + len(line)


def printed(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Return what a command prints; `up` starts processes, for which it needs one of its own."""
    if words[0] != "up":
        command.main(words)
        return capsys.readouterr().out
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(Path.cwd())}
    call = [sys.executable, "-m", "rbxcompose", *words]
    return subprocess.run(call, env=environment, capture_output=True, text=True, check=True).stdout


def test_who_follows_it_sees_what_it_tells(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    shown = ""
    for block in WALK:
        if block.language == "sh":
            shown = "".join(printed(shlex.split(line)[1:], capsys) for line in block.text.splitlines())
        elif block.language == "text":
            see(shown, block.text)
        elif is_walked_through(block):
            path = Path(block.words[1])
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text, encoding="utf-8")
            assert check_file(tmp_path / ROBOT).codes == ([block.wrong] if block.wrong else []), str(block)


def test_every_kind_of_step_has_its_line() -> None:
    table = TEXT.partition("## 12.")[2]
    told = {name for row in re.findall(r"^\| (.*?) \|", table, re.MULTILINE) for name in re.findall(r"`(\w+)`", row)}
    assert set(kinds()) <= told
    assert told - set(kinds()) == {"go_to", "recharge", "say"}


def test_the_whole_mission_is_told_line_by_line() -> None:
    """What the table quotes stands in the file, in its order, and nothing that the robot does is left out."""
    mission = (ROOT / "missions/clean_house.yaml").read_text(encoding="utf-8")
    table = TEXT.partition("## 11.")[2].partition("## 12.")[0]
    quoted = [
        piece for row in re.findall(r"^\| (`.*?) \|", table, re.MULTILINE) for piece in re.findall(r"`(.+?)`", row)
    ]
    assert [piece for piece in quoted if piece not in mission] == []
    body = [line.partition("#")[0].strip(" -") for line in mission.partition("interrupts:")[2].splitlines()]
    words = [line for line in body if line and line != "do:"]
    assert [line for line in words if not any(line in piece for piece in quoted)] == []


def test_every_mission_after_the_book_is_in_its_table() -> None:
    page = (ROOT / "docs/book.md").read_text(encoding="utf-8")
    told = set(re.findall(r"`(\w+)`", "".join(re.findall(r"^\|[^|]*\|([^|]*)\|", page, re.MULTILINE))))
    there = {path.stem for path in (ROOT / "missions").glob("*.yaml")}
    assert told == there - {"haul"}
