from __future__ import annotations

from pathlib import Path

import pytest

from tests.parts.project import Project


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Project:
    """A project in the current folder, so that findings name its files from there."""
    monkeypatch.chdir(tmp_path)
    return Project(tmp_path)
