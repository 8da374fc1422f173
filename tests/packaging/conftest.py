"""What is built once for these tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from release.build import build
from tests.packaging.builds import NODE_MODULES, ROOT
from tests.soak import Soak

STATIC = ROOT / "rbxcompose/domains/console/static"
MODULES = NODE_MODULES if NODE_MODULES.exists() else None


@pytest.fixture(scope="package")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with the wheel and the source distribution."""
    folder = tmp_path_factory.mktemp("built")
    build(folder, node_modules=MODULES)
    return folder


@pytest.fixture(scope="package")
def wheel(request: pytest.FixtureRequest, soak: Soak, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel; only where tests of the source distribution run as well, both are built."""
    if soak.is_on:
        built: Path = request.getfixturevalue("built")
    else:
        page = STATIC if STATIC.exists() else None  # built again by `make soak`, or if its sources are newer
        build(built := tmp_path_factory.mktemp("wheel"), wheel_only=True, node_modules=MODULES, page=page)
    [wheel] = built.glob("*.whl")
    return wheel
