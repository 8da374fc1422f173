"""One project for all tests of a module: compiling a robot takes longer than most tests."""

from __future__ import annotations

import pytest

from tests.mission_tests.trying import Trying


@pytest.fixture(scope="module")
def trying(tmp_path_factory: pytest.TempPathFactory) -> Trying:
    return Trying(tmp_path_factory.mktemp("project"))
