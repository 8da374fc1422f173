"""Verbs in processes of their own: whatever they do, there is an answer."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from rbxcompose.base.requests import Refused
from rbxcompose.tools.mcp import verb_process
from rbxcompose.tools.mcp.verb_process import VerbOutput, run_verb


def test_what_is_kept_of_an_output_is_limited(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(verb_process, "MOST_OUTPUT", 100)
    output = asyncio.run(run_verb("help", folder=tmp_path))
    assert (output.code, len(output.out)) == (0, 100)
    with pytest.raises(Refused, match="the answer is too large"):
        output.data(0)


@pytest.mark.parametrize(
    ("output", "told"),
    [
        (VerbOutput(1, "", "Traceback (most recent call last):\n  x\nKeyError: 3\n"), "has failed: KeyError: 3"),
        (VerbOutput(-9, "", ""), "the command ended with -9 and gave no answer"),
        (VerbOutput(2, "{}", "wrong\n"), "wrong"),
        (VerbOutput(0, "no", ""), "gave no answer"),
    ],
)
def test_what_went_wrong_is_told(output: VerbOutput, told: str) -> None:
    with pytest.raises(Refused, match=told):
        output.data(0)
