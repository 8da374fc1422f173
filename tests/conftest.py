"""Fixtures for all tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.testing.golden import Golden

ROOT = Path(__file__).parents[1]


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="write golden files anew")


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Golden:
    """Golden files in the folder `golden` beside the test."""
    return Golden(request.path.parent / "golden", update=bool(request.config.getoption("--update-golden")))


@pytest.fixture
def repository(monkeypatch: pytest.MonkeyPatch) -> Path:
    """The repository's root, as the current directory, so that findings name files as a person would see them."""
    monkeypatch.chdir(ROOT)
    return ROOT
