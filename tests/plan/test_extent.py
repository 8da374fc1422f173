from __future__ import annotations

import pytest

from rbxcompose.compiler.plan.model import extent


@pytest.mark.parametrize(
    ("components", "processes", "text"),
    [
        (1, 1, "1 component in 1 process"),
        (2, 1, "2 components in 1 process"),
        (8, 3, "8 components in 3 processes"),
        (0, 0, "0 components in 0 processes"),
    ],
)
def test_one_is_no_plural(components: int, processes: int, text: str) -> None:
    assert extent(components, processes) == text
