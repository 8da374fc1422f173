"""A cable between two ends of TCP on this machine that can be cut: what is sent is held back, and nobody is told."""

from __future__ import annotations

import selectors
import socket
import threading
from typing import Self

_LOOK = 0.02  # [s]
_MOST = 65536  # [bytes]


class Relay:
    """Passes on what whoever dials `port` and the server at `to` send each other, unless it `is_cut`."""

    def __init__(self, to: int) -> None:
        self._to, self.is_cut, self._is_over = to, False, False
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._server.getsockname()[1])
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._is_over = True
        self._thread.join()

    def _run(self) -> None:
        other: dict[socket.socket, socket.socket] = {}
        with selectors.DefaultSelector() as selector, self._server:
            selector.register(self._server, selectors.EVENT_READ)
            while not self._is_over:
                for key, _ in () if self.is_cut else selector.select(_LOOK):
                    end = key.fileobj
                    assert isinstance(end, socket.socket)
                    if end is self._server:
                        here, there = end.accept()[0], socket.socket()
                        if there.connect_ex(("127.0.0.1", self._to)):  # nobody is there yet, or any more
                            here.close()
                            there.close()
                            continue
                        other |= {here: there, there: here}
                        for one in (here, there):
                            selector.register(one, selectors.EVENT_READ)
                    elif end in other:
                        self._pass_on(selector, end, other)
                if self.is_cut:
                    threading.Event().wait(_LOOK)
        for end in other:
            end.close()

    def _pass_on(
        self, selector: selectors.BaseSelector, end: socket.socket, other: dict[socket.socket, socket.socket]
    ) -> None:
        try:
            data = end.recv(_MOST)
            other[end].sendall(data)
        except OSError:
            data = b""
        if not data:
            for one in (end, other[end]):
                selector.unregister(one)
                one.close()
                del other[one]
