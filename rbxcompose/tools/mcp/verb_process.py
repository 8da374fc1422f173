"""Verbs in processes of their own: whatever happens in one, the server goes on."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
from asyncio.subprocess import PIPE
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from anyio import CancelScope

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Refused

MOST_OUTPUT = 16_000_000  # [B] that are kept of what a verb writes
_CHUNK = 65536  # [B]
_CRASH = "Traceback (most recent call last)"
_WORDS = 4000  # characters of what went wrong
ANYWHERE = Path("/")
"""Where verbs about robots that run are at home: no file there has the name of a robot."""


@dataclass(frozen=True, slots=True)
class VerbOutput:
    """What a verb wrote, and its exit code."""

    code: int
    out: str
    err: str

    def data(self, *codes: int) -> Any:
        """Return the answer in JSON if the verb ended with one of these exit codes.

        Raises:
            Refused: with what is wrong.
        """
        if self.code not in codes:
            raise Refused(self.trouble)
        try:
            return json.loads(self.out)
        except ValueError as error:
            is_cut = len(self.out.encode()) >= MOST_OUTPUT
            raise Refused("the answer is too large" if is_cut else self.trouble) from error

    @property
    def trouble(self) -> str:
        """Return what is wrong, in words for people."""
        errors = self.err.strip()
        if _CRASH in errors:
            return f"the command has failed: {errors.splitlines()[-1][:_WORDS]}"
        return errors[-_WORDS:] or f"the command ended with {self.code} and gave no answer"


async def run_verb(*words: str, folder: Path = ANYWHERE, unsaved: Mapping[str, str] | None = None) -> VerbOutput:
    """Run a verb, which is ended if the caller is cancelled; `unsaved` are texts in place of those of files."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-P", "-m", "rbxcompose", *words, *(("--unsaved", "-") if unsaved else ())),
        cwd=folder,
        stdin=PIPE,
        stdout=PIPE,
        stderr=PIPE,
        start_new_session=True,
    )
    try:
        out, err = await _exchanged(process, json.dumps(unsaved) if unsaved else "")
        return VerbOutput(await process.wait(), out, err)
    finally:
        if process.returncode is None:
            with suppress(ProcessLookupError):  # it has just ended
                os.killpg(process.pid, signal.SIGKILL)
            with CancelScope(shield=True):
                await process.wait()


async def _exchanged(process: asyncio.subprocess.Process, given: str) -> Sequence[str]:
    """Give a process its input, and return what it writes to both of its outputs."""
    if process.stdin is None or process.stdout is None or process.stderr is None:
        raise BrokenPipeError
    with suppress(BrokenPipeError, ConnectionResetError):  # it has ended without reading
        process.stdin.write(given.encode(errors="replace"))
        process.stdin.close()
    return await asyncio.gather(_text(process.stdout), _text(process.stderr))


async def _text(stream: asyncio.StreamReader) -> str:
    kept = bytearray()
    while chunk := await stream.read(_CHUNK):
        kept += chunk[: MOST_OUTPUT - len(kept)]
    return kept.decode(errors="replace")
