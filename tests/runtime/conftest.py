"""A robot of toys in real processes."""

from __future__ import annotations

import os
import shutil
import signal
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from tests.runtime.real_robot import LOG_FILES, Robot


@pytest.fixture
def robot(request: pytest.FixtureRequest) -> Iterator[Robot]:
    """A robot of which nothing may be left at the end but its logs."""
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    made = Robot(f"toy_{os.getpid()}_{abs(hash(request.node.name)) % 10**6}", base)
    yield made
    for process in made.started:
        with suppress(ProcessLookupError):
            process.kill()
        process.communicate()
    left = made.processes()
    for one in left:
        one.send_signal(signal.SIGKILL)
    files = {path.name for path in made.folder.path.glob("*")} - LOG_FILES
    shutil.rmtree(base)
    assert (left, files) == ([], set())
