"""The cheat sheet leaves nothing out: each section, kind of step and modifier stands in an example or a list."""

from __future__ import annotations

import re
from pathlib import Path

from rbxcompose.manifest.registry import sections
from rbxcompose.missions.program.registry import kinds, modifiers
from tests.docs.examples import ROOT, checked, page_blocks

PAGE = (ROOT / "docs/cheat_sheet.md").read_text(encoding="utf-8")
SHOWN = "\n".join(re.findall(r"^```yaml.*?^```$", PAGE, re.MULTILINE | re.DOTALL))
WANTED = "give each of these an example in docs/cheat_sheet.md, or name it there if it is a modifier"


def test_it_shows_every_section_and_every_kind_of_step() -> None:
    keys = set(re.findall(r"^([a-z0-9_]+):", SHOWN, re.MULTILINE))
    assert {section.name for section in sections()} - keys == set(), WANTED
    steps = set(re.findall(r"(?:- |\{|\[|^)([a-z_]+):", SHOWN, re.MULTILINE))
    assert set(kinds()) - steps == set(), WANTED


def test_it_names_every_modifier() -> None:
    assert {name for name in modifiers() if f"`{name}`" not in PAGE} <= {"on_enter", "on_exit"}, WANTED


def test_it_takes_two_pages() -> None:
    assert len(PAGE.split()) < 1300, "make docs/cheat_sheet.md shorter, such as by shorter comments in its examples"


def test_a_whole_robot_on_it_has_no_warnings(tmp_path: Path) -> None:
    blocks = [
        block for block in page_blocks("yaml") if (block.page, "robot" in block.words) == ("cheat_sheet.md", False)
    ]
    robots = [block for block in blocks if "\nkind: Robot\n" in block.text]
    assert robots
    for block in robots:
        assert checked(block, tmp_path / str(block.line)).codes == [], str(block)
