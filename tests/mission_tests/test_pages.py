"""The tests of missions that pages show pass, and the page of the language has all their words."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rbxcompose.base.config import Config
from rbxcompose.commands.formats.text import render_text
from rbxcompose.manifest.test_file import EventModel, ExpectModel, MockModel, TrialFile
from rbxcompose.tools.mission_tests.reader import TrialReader
from rbxcompose.tools.mission_tests.runner import run_trial
from tests.docs.examples import ROOT, Block, page_blocks

PAGE = (ROOT / "docs/language.md").read_text(encoding="utf-8").partition("### Tests of missions")[2]


@pytest.mark.parametrize("block", page_blocks("yaml", trials=True), ids=str)
def test_a_test_on_a_page_passes(block: Block, tmp_path: Path) -> None:
    for folder in ("robots", "missions"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    (tmp_path / "tests" / "pages").mkdir(parents=True)
    path = tmp_path / "tests" / "pages" / "shown.test.yaml"
    path.write_text(block.text, encoding="utf-8")
    reading = TrialReader({})
    trial, report = reading.read(path)
    assert trial is not None, render_text(report, reading.sources)
    assert trial.is_complete
    assert [problem.message for problem in run_trial(trial).problems] == []


@pytest.mark.parametrize("model", [TrialFile, MockModel, EventModel, ExpectModel])
def test_the_page_has_every_key(model: type[Config]) -> None:
    keys = {field.alias or name for name, field in model.model_fields.items()} - {"rbx", "kind", "name", "about"}
    assert [key for key in keys if f"`{key}`" not in PAGE and f"`{key}: true`" not in PAGE] == []


def test_the_schema_has_every_key() -> None:
    assert set(json.loads((ROOT / "schemas/test.schema.json").read_text(encoding="utf-8"))["properties"]) == {
        field.alias or name for name, field in TrialFile.model_fields.items()
    }
