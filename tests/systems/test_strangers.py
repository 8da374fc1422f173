"""Whoever cannot prove to be of the system is not linked, by TLS or QUIC, and who is of it goes on."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path

import pytest

from rbxcompose.bus.zenoh_session import tls_settings
from rbxcompose.compiler.systems.certificates import make_authority, make_certificate, tls_of
from tests.conftest import ROOT
from tests.forked import Forked
from tests.soak import rare
from tests.systems.test_links import free_port

ROUTER = str(Path(__file__).with_name("linked_router.py"))
pytestmark = pytest.mark.skipif(shutil.which("openssl") is None, reason="needs openssl")


def proof(folder: Path, host: str, *, days: int = 10) -> dict[str, object]:
    """Return how a host of a system `lab` with its authority in this folder proves who it is."""
    make_authority(folder, "lab")
    make_certificate(folder, "lab", host, "127.0.0.1", days=days)
    files = tls_of(folder, host, "mtls")
    return tls_settings(files.authority, files.certificate, files.key, mutual=True)


class Routers:
    """Routers that run side by side until this ends."""

    def __init__(self) -> None:
        self._until = ExitStack()

    def __enter__(self) -> Routers:
        return self

    def __exit__(self, *_: object) -> None:
        self._until.close()

    def start(self, listen: str, dial: str, tls: Mapping[str, object]) -> tuple[subprocess.Popen[str], str]:
        """Return a router's process, whose further output are those that it is linked with, and its identity."""
        words = [sys.executable, ROUTER, listen, dial, json.dumps(tls)]
        pipe = subprocess.PIPE
        process = Forked(words, stdin=pipe, stdout=pipe, text=True, cwd=ROOT, env=os.environ)
        self._until.enter_context(process)
        self._until.callback(process.kill)
        assert process.stdout
        return process, process.stdout.readline()


@pytest.mark.parametrize("protocol", ["tls", *rare("quic")])
def test_only_a_valid_certificate_of_the_system_is_let_in(protocol: str, tmp_path: Path) -> None:
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    listener, friend = proof(ours, "robot"), proof(ours, "desk")
    stranger = {**proof(theirs, "desk"), "root_ca_certificate": friend["root_ca_certificate"]}
    nobody = {name: value for name, value in friend.items() if "connect_" not in name or "verify" in name}
    link = f"{protocol}/127.0.0.1:{free_port()}"
    with Routers() as routers:
        router, _ = routers.start(link, "-", listener)
        for refused in (nobody, stranger, proof(ours, "late", days=-1)):
            routers.start("-", link, refused)
        _, expected = routers.start("-", link, friend)
        assert router.stdout
        assert router.stdout.readline() == expected, "those that came before are not let in"
