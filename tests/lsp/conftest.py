"""A language server, and a project for its tests."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.lsp.client import Client


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """One server for all tests of a file: no question spoils the answers to the next ones."""
    with Client(tmp_path_factory.mktemp("editor")) as client:
        yield client
    assert client.process.returncode == 0
    assert client.errors == b""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    shutil.copytree(ROOT / "robots/turtlebot", tmp_path / "robots/turtlebot")
    shutil.copytree(ROOT / "missions", tmp_path / "missions")
    return tmp_path
