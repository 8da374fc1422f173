"""The patrol robot on two hosts that the test makes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.systems.namespaces import Hosts, NotPermittedError
from tests.systems.patrol import ADDRESSES, PatrolOnHosts


@pytest.fixture
def patrol(tmp_path: Path) -> Iterator[PatrolOnHosts]:
    try:
        hosts = Hosts(tmp_path, ADDRESSES)
    except NotPermittedError as reason:
        pytest.skip(str(reason))
    with hosts:
        yield PatrolOnHosts(hosts)
