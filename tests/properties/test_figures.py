"""The pages of figures are what their scripts make of the results."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import pytest

from benchmarks.run import PAGE, RESULTS, page, subjects

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_of_benchmarks_shows_the_results() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(json.loads(RESULTS.read_text(encoding="utf-8")))


def test_every_subject_has_been_measured() -> None:
    results = json.loads(RESULTS.read_text(encoding="utf-8"))
    assert {row["subject"] for row in results["rows"]} == set(subjects())


@pytest.mark.parametrize("name", ["quality", "robots_tried"])
def test_the_page_of_figures_shows_what_the_soak_has_found(name: str) -> None:
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec
    assert spec.loader
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    assert (DOCS / f"{name}.md").read_text(encoding="utf-8") == script.page()
