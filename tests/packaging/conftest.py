"""What is built once for these tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from release.build import build
from tests.packaging.builds import NODE_MODULES


@pytest.fixture(scope="package")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with the wheel and the source distribution."""
    folder = tmp_path_factory.mktemp("built")
    build(folder, node_modules=NODE_MODULES if NODE_MODULES.exists() else None)
    return folder


@pytest.fixture(scope="package")
def wheel(built: Path) -> Path:
    """The wheel."""
    [wheel] = built.glob("*.whl")
    return wheel
