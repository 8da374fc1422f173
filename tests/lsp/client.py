"""A small client of the Language Server Protocol, over the pipes of a child process."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from tests.conftest import ROOT
from tests.forked import Forked

OURS = (sys.executable, "-m", "rbxcompose", "lsp", "--stdio")


class Client:
    """Starts a server, ours or another, in a folder; leaving the context shuts it down and waits for its end."""

    def __init__(self, folder: Path, words: Sequence[str] = OURS) -> None:
        pipe, start = subprocess.PIPE, Forked if tuple(words[:3]) == OURS[:3] else subprocess.Popen
        self.process: subprocess.Popen[Any] = start(
            words, cwd=folder, env=os.environ.copy(), stdin=pipe, stdout=pipe, stderr=pipe
        )
        self.told: deque[dict[str, Any]] = deque()  # notifications that nobody has waited for yet
        self.questions: list[dict[str, Any]] = []  # of the server
        self.number = 0
        self.errors = b""

    def __enter__(self) -> Self:
        capabilities = {
            "textDocument": {"publishDiagnostics": {"relatedInformation": True}},
            "workspace": {"didChangeWatchedFiles": {"dynamicRegistration": True}},
        }
        try:
            self.ask("initialize", processId=None, rootUri=ROOT.as_uri(), capabilities=capabilities)
        except BaseException:
            self.process.kill()
            self.process.communicate()
            raise
        self.tell("initialized")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.ask("shutdown")
            self.tell("exit")
        else:
            self.process.kill()  # a test that fails leaves nothing behind
        _, self.errors = self.process.communicate(timeout=10.0)

    def tell(self, method: str, **params: Any) -> None:
        self._send({"jsonrpc": "2.0", "method": method, "params": params})

    def ask(self, method: str, **params: Any) -> Any:
        """Send a request and return its result."""
        message = self._answer(method, **params)
        assert "error" not in message, message
        return message["result"]

    def refusal(self, method: str, **params: Any) -> str:
        """Send a request that is refused and return the reason."""
        return str(self._answer(method, **params)["error"]["message"])

    def _answer(self, method: str, **params: Any) -> dict[str, Any]:
        self.number += 1
        self._send({"jsonrpc": "2.0", "id": self.number, "method": method, "params": params or None})
        while "id" not in (message := self._receive()) or "method" in message:
            if "id" in message:  # a question of the server
                settings = [None for _ in message["params"].get("items", ())]
                self._send({"jsonrpc": "2.0", "id": message["id"], "result": settings})
            else:
                self.told.append(message)
        assert message["id"] == self.number
        return message

    def diagnostics(self, uri: str) -> list[dict[str, Any]]:
        """Wait for the next findings of a document."""
        while True:
            message = self.told.popleft() if self.told else self._receive()
            if message.get("method") == "textDocument/publishDiagnostics" and message["params"]["uri"] == uri:
                found: list[dict[str, Any]] = message["params"]["diagnostics"]
                return found

    def _send(self, message: dict[str, Any]) -> None:
        assert self.process.stdin
        body = json.dumps(message).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n%b" % (len(body), body))
        self.process.stdin.flush()

    def _receive(self) -> dict[str, Any]:
        assert self.process.stdout
        size = 0
        while line := self.process.stdout.readline().strip():
            name, _, value = line.partition(b":")
            size = int(value) if name.lower() == b"content-length" else size
        assert size, "the server has gone"
        message: dict[str, Any] = json.loads(self.process.stdout.read(size))
        if {"id", "method"} <= message.keys():
            self.questions.append(message)
        return message
