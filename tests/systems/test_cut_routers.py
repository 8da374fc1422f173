"""Routers of three hosts hear each other again whenever one was cut off."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.systems.namespaces import Hosts, NotPermittedError
from tests.systems.patrol import ADDRESSES, ENVIRONMENT

HOSTS = {**ADDRESSES, "m": "10.42.7.3"}
PATIENCE = 8.0  # [s]
CUTS, CUT = 3, 1.0  # their number; [s] that each lasts on, until both ends have given the link up


@pytest.mark.timeout(60)
def test_a_router_that_was_cut_off_hears_all_others_again_and_they_hear_it(tmp_path: Path) -> None:
    try:
        hosts = Hosts(tmp_path, HOSTS)
    except NotPermittedError as reason:
        pytest.skip(str(reason))
    with hosts:
        dialled: list[str] = []
        for host, address in HOSTS.items():
            listen = f"tcp/{address}:7500"
            words = [
                "-m",
                "tests.systems.telling_router",
                host,
                listen,
                ",".join(dialled),
                str(tmp_path / f"{host}.txt"),
            ]
            hosts.start(host, sys.executable, *words, environment=ENVIRONMENT)
            dialled.append(listen)
        all_hear_all = {host: sorted({*HOSTS} - {host}) for host in HOSTS}
        _wait_until(lambda: {host: _heard(tmp_path, host) for host in HOSTS} == all_hear_all)
        for _ in range(CUTS):
            hosts.cut("m")
            _wait_until(lambda: not {"m"} & {*_heard(tmp_path, "r"), *_heard(tmp_path, "d")})
            time.sleep(CUT)  # what is tested is time
            hosts.mend("m")
            _wait_until(lambda: {host: _heard(tmp_path, host) for host in HOSTS} == all_hear_all)


def _heard(folder: Path, host: str) -> list[str]:
    path = folder / f"{host}.txt"
    return path.read_text(encoding="utf-8").split() if path.exists() else []


def _wait_until(holds: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.05)
