"""Commands in this process compile each robot that ships once: what a command does then is what its tests are about."""

from __future__ import annotations

import pytest

from rbxcompose.commands import targets
from tests.shipped import compiled


@pytest.fixture(autouse=True)
def _compiled_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(targets, "compile_robot", compiled)
