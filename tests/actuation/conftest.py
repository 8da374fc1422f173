"""Fake servos for tests of the byte path."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from rbxcompose.base.clock import SteppedClock
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_line import FakeLine
from rbxcompose.domains.servos.twins.servo_twin import FakePort

Plugged = Callable[..., FakePort]


@pytest.fixture
def clock() -> SteppedClock:
    """Return the time by which fake servos move."""
    return SteppedClock()


@pytest.fixture
def plugged(tmp_path: Path, clock: SteppedClock) -> Iterator[Plugged]:
    """Return a function that plugs servos into a pseudo-terminal; all are unplugged after the test."""
    with ExitStack() as stack:

        def plug(*servos: FakeServo, **options: bool) -> FakePort:
            line = FakeLine(servos, clock.now)
            return stack.enter_context(FakePort(line, tmp_path / "servos", **options))

        yield plug
