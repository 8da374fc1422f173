from __future__ import annotations

import selectors
import socket
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from rbxcompose.base.requests import Query, Refused, name_in, requests, to_data
from rbxcompose.runtime.control import ControlServer, NoAnswerError, ask
from rbxcompose.runtime.folder import SOCKET, RobotFolder


@dataclass(frozen=True, slots=True)
class Echoed:
    text: str


@dataclass(frozen=True, slots=True)
class Echo(Query[Echoed]):
    about = "robot"
    text: str


TAKEN = requests(Echo)


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

    def _handle(self, data: object, number: int) -> None:
        if name_in(data) != "robot.Echo":
            self.server.refuse(number, "this is no request")
            return
        match TAKEN.from_data(data):
            case Echo(text="no"):
                self.server.refuse(number, "since I say so")
            case Echo(text="old"):
                self.server.answer(number, {"words": []})
            case Echo(text=text) if text != "silence":
                self.server.answer(number, to_data(Echoed(text)))

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


@pytest.mark.parametrize("size", [100_000, 219_000, 5_000_000])
def test_an_answer_of_any_size_arrives_whole(served: Served, size: int) -> None:
    assert ask(served.folder, Echo("x" * size)) == Echoed("x" * size)


def test_a_client_that_takes_its_answer_slowly_holds_up_nobody(served: Served) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as slow, pytest.MonkeyPatch.context() as patch:
        patch.chdir(served.folder.path)
        slow.connect(SOCKET)
        slow.sendall(TAKEN.to_line(Echo("x" * 2_000_000)))
        assert ask(served.folder, Echo("quick")) == Echoed("quick")
        with slow.makefile("rb") as file:
            assert len(file.readline()) > 2_000_000


def test_an_answer_that_is_cut_is_no_answer(served: Served) -> None:
    def cut(request: object, number: int) -> None:
        served.server.answer(number, "x" * 5_000_000)
        served.server._drop(number)

    served.server.handle = cut
    with pytest.raises(NoAnswerError):
        ask(served.folder, Echo("x"))


def test_a_request_is_answered(served: Served) -> None:
    assert ask(served.folder, Echo("ä\n")) == Echoed("ä\n")


def test_a_refusal_comes_with_its_reason(served: Served) -> None:
    with pytest.raises(Refused, match="since I say so"):
        ask(served.folder, Echo("no"))


def test_the_answer_of_another_version_is_a_refusal(served: Served) -> None:
    with pytest.raises(Refused, match="another version of rbxcompose: 'words' is not known here"):
        ask(served.folder, Echo("old"))


def test_silence_is_noticed(served: Served) -> None:
    with pytest.raises(NoAnswerError):
        ask(served.folder, Echo("silence"), timeout=0.05)


def test_nonsense_is_refused_and_hurts_nobody(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(served.folder.path)
    for nonsense in (b"hello\n", b"[1, 2]\n", b"\xff\n"):
        with socket.socket(socket.AF_UNIX) as connection:
            connection.settimeout(5.0)
            connection.connect("control.sock")
            connection.sendall(nonsense)
            assert b"refused" in connection.recv(1000)
    assert ask(served.folder, Echo("still")) == Echoed("still")


def test_where_nobody_listens_there_is_no_answer(tmp_path: Path) -> None:
    with pytest.raises(NoAnswerError):
        ask(RobotFolder(tmp_path), Echo("hello"))
