"""The language page names everything that there is, so that nobody has to read the code for a word."""

from __future__ import annotations

import re

from docs.generating.robot import models_below
from rbxcompose.base.config import Config
from rbxcompose.base.expressions.types import TYPES
from rbxcompose.base.expressions.values import FUNCTIONS
from rbxcompose.base.units import UNITS
from rbxcompose.manifest.registry import FILES, file_model, sections
from rbxcompose.manifest.section import ComponentOptions
from rbxcompose.missions.language.reader import INPUT_KEYS, INTERRUPT_KEYS, KEYS
from rbxcompose.missions.program.program import AFTERWARDS
from rbxcompose.missions.program.registry import modifiers
from tests.docs.examples import ROOT
from tests.loops import for_all

PAGE = (ROOT / "docs/language.md").read_text(encoding="utf-8")
ROWS = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in PAGE.splitlines() if line[:1] == "|"]
QUOTED = frozenset(word for piece in re.findall(r"`([^`\n]+)`", PAGE) for word in piece.replace(":", " ").split())
WORDS = frozenset(re.findall(r"[\w%/^]+", PAGE))


def row(first: str) -> str:
    found = [" ".join(cells) for cells in ROWS if re.match(rf"`{re.escape(first)}[`( ]", cells[0])]
    assert found, f"no table has a row for '{first}'"
    return " ".join(found)


def test_it_has_every_unit_type_and_function() -> None:
    assert UNITS.keys() - QUOTED == set()
    assert {*TYPES, "choice"} - QUOTED == set()
    assert [name for name in FUNCTIONS if f"`{name}(" not in PAGE] == []


MODELS = [*map(file_model, FILES), *(model for section in sections() for _, model in models_below(section.type, ""))]


@for_all("model", MODELS)
def test_it_has_every_key_of_a_robot(model: type[Config]) -> None:
    keys = {field.alias or name for name, field in model.model_fields.items()}
    assert keys - WORDS == set()


def test_it_has_every_option_of_components() -> None:
    assert all(row(option) for option in ComponentOptions.model_fields)


def test_it_has_the_modifiers_in_their_order() -> None:
    first = [cells[0].strip("`") for cells in ROWS]
    places = [first.index(name) for name in modifiers()]
    assert places == sorted(places)


def test_it_has_every_key_of_a_mission() -> None:
    assert {*KEYS, *INTERRUPT_KEYS, *INPUT_KEYS, *AFTERWARDS} - WORDS == set()
