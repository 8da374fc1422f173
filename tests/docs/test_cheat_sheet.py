"""The cheat sheet leaves nothing out: each section, kind of step and modifier stands in an example or a list."""

from __future__ import annotations

import re

from rbxcompose.manifest.registry import sections
from rbxcompose.missions.program.registry import kinds, modifiers
from tests.docs.examples import ROOT

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
