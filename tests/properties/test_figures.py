"""The pages of figures are what their scripts make of the results."""

from __future__ import annotations

import importlib.util
import json
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.measuring import ROOT, Row
from benchmarks.run import PAGE, RESULTS, as_data, has_changed, page, paths_of, subjects, worse

ROWS = json.loads(RESULTS.read_text(encoding="utf-8"))["rows"]
DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_of_benchmarks_shows_the_results() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(json.loads(RESULTS.read_text(encoding="utf-8")))


def test_every_subject_has_been_measured() -> None:
    assert {row["subject"] for row in ROWS} == set(subjects())


@pytest.mark.parametrize("subject", subjects())
def test_a_figure_is_marked_once_what_it_measures_has_changed(subject: str) -> None:
    assert [path for path in paths_of(subject) if not (ROOT / path).exists()] == []
    unmarked = {row["commit"] for row in ROWS if row["subject"] == subject and not row["changed"]}
    for commit in unmarked:
        if subprocess.run(["git", "cat-file", "-e", commit], cwd=ROOT, capture_output=True).returncode:
            pytest.skip("the history is not here")
        assert not has_changed(subject, commit), "run 'python -m benchmarks.run --marks', or measure it again"


def test_what_got_worse_is_said_with_both_figures() -> None:
    rows = [
        Row("compile", "ms", "", ours=590.0, most=2000),
        Row("floods", "1/s", "", ours=100.0, least=50),
        Row("hops", "ms", "", ours=1.0, peer=1.0, against="Zenoh", most_ratio=1.2),
        Row("noise", "ms", "", ours=1.0, most=2),
        Row("no bar", "ms", "", ours=1.0),
    ]
    after = zip(rows, (2800.0, 40.0, 3.0, 1.1, 5.0), strict=True)
    before = [as_data(row, "toy") for row in rows]
    assert worse(before, [as_data(replace(row, ours=ours), "toy") for row, ours in after]) == [
        "- Worse: compile: 2800 ms, before 590 ms.",
        "- Worse: floods: 40 1/s, before 100 1/s.",
        "- Worse: hops: 3x of Zenoh, before 1x of Zenoh.",
    ]
    assert worse(before, before) == []


@pytest.mark.parametrize("name", ["quality", "robots_tried"])
def test_the_page_of_figures_shows_what_the_soak_has_found(name: str) -> None:
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec
    assert spec.loader
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    assert (DOCS / f"{name}.md").read_text(encoding="utf-8") == script.page()
