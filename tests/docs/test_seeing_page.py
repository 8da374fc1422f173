"""The page on seeing a robot shows what its commands really print."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator
from itertools import pairwise

import pytest

from rbxcompose.commands import main as command
from tests.docs.examples import ROOT, Block, blocks_of
from tests.loops import for_all

PAGE = ROOT / "docs/inspection.md"
SKIPS = "..."


def shown_in(blocks: Iterable[Block]) -> Iterator[tuple[Block, Block]]:
    """Yield each command with what the page shows below it."""
    yield from (
        (block, other) for block, other in pairwise(blocks) if (block.language, other.language) == ("sh", "text")
    )


SHOWN = list(shown_in(blocks_of(PAGE.read_text(encoding="utf-8"), PAGE.name)))


@pytest.mark.usefixtures("repository")
@for_all("asked, shown", SHOWN)
def test_a_command_prints_what_stands_below_it(asked: Block, shown: Block, capsys: pytest.CaptureFixture[str]) -> None:
    compare(asked, shown, capsys)


def compare(asked: Block, shown: Block, capsys: pytest.CaptureFixture[str]) -> None:
    """Run a command and require that it prints what is shown, in this order; `...` stands for what is left out."""
    [line] = asked.text.splitlines()
    program, *words = shlex.split(line)
    assert program == "rbxcompose"
    assert command.main(words) == 0
    printed = iter(capsys.readouterr().out.splitlines())
    for wanted in shown.text.splitlines():
        assert wanted == SKIPS or wanted in printed, wanted  # in their order; others may lie between


def test_each_verb_has_an_example() -> None:
    assert {shlex.split(asked.text)[1] for asked, _ in SHOWN} == {"expand", "why", "graph", "plan"}
