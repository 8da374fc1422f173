"""The page about programs shows code that runs in tests."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_its_code_is_that_of_the_base_which_patrols_in_tests() -> None:
    page = (ROOT / "docs/programs.md").read_text(encoding="utf-8")
    base = (ROOT / "tests/programs/bare_base.py").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    assert blocks
    assert [block for block in blocks if block not in base] == []
