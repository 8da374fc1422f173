"""Verbs in processes of their own: whatever they do, there is an answer."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from rbxcompose.base.requests import Refused
from rbxcompose.tools.mcp import verb_process
from rbxcompose.tools.mcp.verb_process import VerbOutput, VerbProcesses


def test_who_comes_while_too_many_wait_is_told_so(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(verb_process, "MOST_WAITING", 3)

    async def crowd() -> list[str]:
        verbs = VerbProcesses(0.01)
        calls = (verbs.compiles("explain", folder=tmp_path) for _ in range(5))
        return [str(end) for end in await asyncio.gather(*calls, return_exceptions=True)]

    late, busy = "it took more than 0.01 s, and was ended", "too many calls are waiting: try again"
    assert asyncio.run(crowd()) == [late] * 3 + [busy] * 2


def test_what_is_kept_of_an_output_is_limited(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(verb_process, "MOST_OUTPUT", 100)
    output = asyncio.run(VerbProcesses(60.0).run("help", folder=tmp_path))
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
