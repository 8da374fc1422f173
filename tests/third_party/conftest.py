"""The package has tests of its own, which need it installed: a test runs them there."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from rbxcompose.base.findings import KINDS, OUR_CODES

collect_ignore = ["rbx_lamp"]


@pytest.fixture(autouse=True)
def known_kinds() -> Iterator[None]:
    """Forget what the packages of a test have declared, which later tests of the same process would find."""
    before = set(KINDS)
    yield
    for code in KINDS.keys() - before:
        if not code.startswith(OUR_CODES):
            del KINDS[code]
