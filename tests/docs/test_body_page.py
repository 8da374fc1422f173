"""The page on bodies shows what its commands print."""

from __future__ import annotations

import pytest

from tests.docs import test_seeing_page as seeing
from tests.docs.examples import ROOT, Block, blocks_of

PAGE = ROOT / "docs/body.md"
SHOWN = list(seeing.shown_in(blocks_of(PAGE.read_text(encoding="utf-8"), PAGE.name)))


@pytest.mark.usefixtures("repository")
@pytest.mark.parametrize(("asked", "shown"), SHOWN, ids=str)
def test_a_command_prints_what_stands_below_it(asked: Block, shown: Block, capsys: pytest.CaptureFixture[str]) -> None:
    seeing.compare(asked, shown, capsys)


def test_the_page_shows_commands() -> None:
    assert len(SHOWN) == 3
