"""The thread of the gateway, without a robot: what it leaves behind, and what it says."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from rbxcompose.base.levels import Level
from rbxcompose.domains.console.components.gateway import GatewayConfig, GatewayThread, words_of
from rbxcompose.testing import Bench, instance


@pytest.fixture(autouse=True)
def _nobody_is_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


@pytest.fixture
def taken() -> Iterator[socket.socket]:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        yield listener


def port_of(listener: socket.socket) -> int:
    return int(listener.getsockname()[1])


def names() -> set[str]:
    return {thread.name for thread in threading.enumerate()}


def test_it_leaves_no_thread_and_no_port(taken: socket.socket) -> None:
    port = port_of(taken)
    taken.close()
    server = GatewayThread(GatewayConfig(robot="one", port=port))
    server.start()
    assert "gateway" in names()
    server.close()
    assert "gateway" not in names()
    with socket.socket() as free:
        free.bind(("127.0.0.1", port))


def test_one_that_never_started_leaves_no_port(taken: socket.socket) -> None:
    port = port_of(taken)
    taken.close()
    GatewayThread(GatewayConfig(robot="one", port=port)).close()
    with socket.socket() as free:
        free.bind(("127.0.0.1", port))


def test_a_port_of_somebody_else_is_said_once(taken: socket.socket) -> None:
    server = GatewayThread(GatewayConfig(robot="one", port=port_of(taken)))
    server.start()
    server.close()
    assert server.status[0] is Level.ERROR
    wanted = f"has no page: port {port_of(taken)}: Address already in use; write another: 'console: {{port: N}}'"
    assert server.said.get_nowait() == wanted
    assert server.said.empty()


def test_nothing_is_served_on_a_stepped_clock() -> None:
    bench = Bench(instance("gateway", "gateway", {"robot": "one"}))
    bench.advance(2.0)
    assert "gateway" not in names()
    assert bench.host.states()["gateway"] == ("active", 0)


def test_what_a_command_says_is_wrong_is_a_sentence_with_what_to_do() -> None:
    warning = {"severity": "warning", "message": "slow", "help": "wait"}
    error = {"severity": "error", "message": "it has errors", "help": "'rbxcompose check' shows them"}
    wanted = "it has errors: 'rbxcompose check' shows them"
    assert words_of({"error": "it has errors", "findings": [warning, error]}) == wanted
    assert words_of({"error": "misused", "findings": []}) == "misused"
