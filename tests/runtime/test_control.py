from __future__ import annotations

import selectors
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from rbxcompose.runtime.control import ControlServer, NoAnswerError, RefusedError, ask
from rbxcompose.runtime.folder import RobotFolder


class Served:
    """A server that answers requests on a thread of its own, one for as long as the test takes."""

    def __init__(self, folder: RobotFolder) -> None:
        self.folder = folder
        self._selector = selectors.DefaultSelector()
        self.server = ControlServer(folder, self._selector)
        self.server.handle = self._handle
        self._is_over = False
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _handle(self, request: dict[str, object], number: int) -> None:
        if request.get("verb") == "no":
            self.server.refuse(number, "since I say so")
        elif request.get("verb") != "silence":
            self.server.answer(number, request)

    def _run(self) -> None:
        while not self._is_over:
            for key, _ in self._selector.select(0.02):
                key.data()

    def close(self) -> None:
        self._is_over = True
        self._thread.join()
        self.server.close()
        self._selector.close()


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    # Deeper than the address of a socket can tell.
    folder = RobotFolder(tmp_path / ("x" * 100) / "toys")
    folder.path.mkdir(parents=True)
    made = Served(folder)
    yield made
    made.close()


def test_a_request_is_answered(served: Served) -> None:
    assert ask(served.folder, {"verb": "ps", "text": "ä\n"}) == {"verb": "ps", "text": "ä\n"}


def test_a_refusal_comes_with_its_reason(served: Served) -> None:
    with pytest.raises(RefusedError, match="since I say so"):
        ask(served.folder, {"verb": "no"})


def test_silence_is_noticed(served: Served) -> None:
    with pytest.raises(NoAnswerError):
        ask(served.folder, {"verb": "silence"}, timeout=0.05)


def test_nonsense_is_refused_and_hurts_nobody(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(served.folder.path)
    for nonsense in (b"hello\n", b"[1, 2]\n", b"\xff\n"):
        with socket.socket(socket.AF_UNIX) as connection:
            connection.settimeout(5.0)
            connection.connect("control.sock")
            connection.sendall(nonsense)
            assert b"refused" in connection.recv(1000)
    assert ask(served.folder, {"verb": "ps"}) == {"verb": "ps"}


def test_where_nobody_listens_there_is_no_answer(tmp_path: Path) -> None:
    with pytest.raises(NoAnswerError):
        ask(RobotFolder(tmp_path), {"verb": "ps"})
