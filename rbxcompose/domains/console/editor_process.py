"""The editor of missions as the gateway sees it: a process of its own, which runs while somebody edits."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

EDITOR = "rbxcompose.tools.mission_editor.process"
MOST_WAITING = 16  # requests
PATIENCE = 30.0  # [s] for an answer
IDLE = 300.0  # [s] after which the process ends
_FAREWELL = 1.0  # [s]


class EditorProcess:
    """Asks the editor of a robot's missions, one question after the other. All methods belong to one event loop."""

    def __init__(
        self, robot: str, command: Sequence[str] = (sys.executable, "-m", EDITOR), *, patience: float = PATIENCE
    ) -> None:
        self._command = (*command, robot)
        self._patience = patience
        self._process: subprocess.Popen[str] | None = None
        self._turn = asyncio.Lock()
        self._waiting = 0
        self._idle: asyncio.TimerHandle | None = None

    async def ask(self, request: Mapping[str, Any]) -> tuple[Any, str]:
        """Return the answer to a request, or why there is none."""
        if self._waiting >= MOST_WAITING:
            return None, "the editor is busy: try again"
        self._waiting += 1
        try:
            async with self._turn:
                return await self._exchanged(json.dumps(request))
        finally:
            self._waiting -= 1

    def close(self) -> None:
        """End the process; what it was asked is not answered."""
        if self._idle is not None:
            self._idle.cancel()
            self._idle = None
        if (process := self._process) is not None:
            self._process = None
            process.kill()
            with suppress(subprocess.TimeoutExpired):
                process.wait(_FAREWELL)
            for pipe in (process.stdin, process.stdout):
                if pipe is not None:
                    with suppress(OSError):
                        pipe.close()

    async def _exchanged(self, line: str) -> tuple[Any, str]:
        if self._idle is not None:
            self._idle.cancel()
        try:
            work = asyncio.to_thread(self._exchange, line)
            told = json.loads(await asyncio.wait_for(work, self._patience))
        except (TimeoutError, OSError, ValueError):
            self.close()
            return None, "the editor did not answer, and starts again: what runs is unharmed"
        self._idle = asyncio.get_running_loop().call_later(IDLE, self.close)
        return told["answer"], str(told["refused"])

    def _exchange(self, line: str) -> str:
        if self._process is None or self._process.poll() is not None:
            self._process = subprocess.Popen(
                self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8"
            )
        there, back = self._process.stdin, self._process.stdout
        if there is None or back is None:
            raise BrokenPipeError
        there.write(f"{line}\n")
        there.flush()
        return back.readline()
