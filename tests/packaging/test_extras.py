"""The extras: what the documentation says of each, and what components say that they need of them."""

from __future__ import annotations

import json
import re
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from packaging.utils import canonicalize_name

from docs.generating.extras import KEPT, PURPOSES, closure, declared, measured

ROOT = Path(__file__).parents[2]
PAIR = re.compile(r'NeedsExtra\((?:sdk\.)?Setting\("(\w+)"\), (?:sdk\.)?Setting\("(\w+)"\)\)')


def test_every_extra_was_measured_as_it_is_declared() -> None:
    kept = json.loads(KEPT.read_text(encoding="utf-8"))
    asked = {name: row["wanted"] for name, row in kept.items()}
    assert asked == declared(), "run `python -m docs.generating.extras`, then `make docs`"
    assert PURPOSES.keys() == kept.keys()


@pytest.mark.soak
def test_the_sizes_are_those_of_this_machine_within_a_fifth() -> None:
    kept, here = json.loads(KEPT.read_text(encoding="utf-8")), measured()
    assert {name: row["packages"] for name, row in kept.items()} == {
        name: one["packages"] for name, one in here.items()
    }
    off = {name: (row["bytes"], here[name]["bytes"]) for name, row in kept.items()}
    assert [name for name, (before, now) in off.items() if not 0.8 < before / now < 1.25] == []


def test_what_a_component_needs_of_an_extra_is_in_it() -> None:
    pairs = {
        pair for file in (ROOT / "rbxcompose").rglob("*.py") for pair in PAIR.findall(file.read_text(encoding="utf-8"))
    }
    assert len(pairs) > 5
    of_module = packages_distributions()
    for module, extra in pairs:
        brought = {canonicalize_name(name) for name in of_module[module]}
        assert brought & closure(declared()[extra]), f"{extra} does not bring {module}"
