"""The docs name tests that show what pages do: those tests exist."""

from __future__ import annotations

import re

from tests.conftest import ROOT


def test_each_test_that_the_docs_name_exists() -> None:
    named = set(re.findall(r"`(test_\w{15,})`", (ROOT / "docs/console.md").read_text(encoding="utf-8")))
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "tests/console").glob("test_*.py")]
    found = {name for text in texts for name in re.findall(r"^def (test_\w+)", text, re.MULTILINE)}
    assert len(named) > 30
    assert named - found == set()
