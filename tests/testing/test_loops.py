"""Tests for the loops of tests: none of their values is forgotten, and each has what is its own."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from tests.loops import for_all


def test_all_values_are_tried_and_each_that_fails_is_named() -> None:
    seen = []

    @for_all("number, text", [(1, "one"), (2, "two"), (3, "three")])
    def promise(number: int, text: str) -> None:
        seen.append(text)
        assert number == 2

    with pytest.raises(ExceptionGroup, match="2 values fail") as failed:
        promise()
    assert seen == ["one", "two", "three"]
    assert [error.__notes__ for error in failed.value.exceptions] == [
        ["number, text: (1, 'one')"],
        ["number, text: (3, 'three')"],
    ]


@for_all("value", ["a", "b"])
def test_a_value_has_its_own_folder_environment_and_output(
    value: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "RBX_LOOP" not in os.environ
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setenv("RBX_LOOP", value)
    (tmp_path / value).touch()
    sys.stdout.write(value)
    assert capsys.readouterr().out == value
    sys.stdout.write("left over")
