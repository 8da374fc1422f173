"""Answers of the fenced process that expands xacro files. They are kept as long as no file that it used changes.

They outlive this process in the user's folder of caches, so that the next command need not expand anything.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from xxhash import xxh3_128_hexdigest

import rbxcompose
from rbxcompose.body.kept_answers import KeptAnswer, keep, read_kept
from rbxcompose.body.xacro_answer import XacroAnswer, read_answer
from rbxcompose.per_compile import once
from rbxcompose.regular_files import read_regular


class XacroRequest(NamedTuple):
    """What is asked, as JSON, and the folders that the answer may be about."""

    text: str
    roots: tuple[str, ...]


DEADLINE = 12.0  # [s] of real time, on a busy machine; the processes limit their processor time themselves
KEPT = 64  # answers
_LARGEST = 8_000_000  # [bytes] of a file that xacro reads
_RUN = "import sys; sys.path.insert(0, sys.argv[1]); from rbxcompose.body.xacro_child import main; main()"
_answers: OrderedDict[XacroRequest, KeptAnswer] = OrderedDict()


def answers(requests: Sequence[XacroRequest]) -> list[XacroAnswer | None]:
    """Return the answer to each request; None where the process did not end within its limits."""
    failed = _failed()
    known = {one: _kept(one) for one in requests}
    new = [one for one, answer in known.items() if answer is None and one not in failed]
    for request, answer in zip(new, _asked(new) if new else (), strict=True):
        known[request] = answer
        if answer is None:
            failed.add(request)
        else:
            kept = KeptAnswer(answer, {path: _digest(path) for path in answer.used})
            _remember(request, kept)
            keep(request.text, kept)
    return [known[one] for one in requests]


@once
def _failed() -> set[XacroRequest]:
    """Return the requests of this compile that had no answer: profiles are tried one after another."""
    return set()


def _kept(request: XacroRequest) -> XacroAnswer | None:
    kept = _answers.get(request) or read_kept(request.text, request.roots)
    if kept is None or any(_digest(path) != digest for path, digest in kept.used.items()):
        return None
    _remember(request, kept)
    return kept.answer


def _remember(request: XacroRequest, kept: KeptAnswer) -> None:
    _answers[request] = kept
    _answers.move_to_end(request)
    if len(_answers) > KEPT:
        _answers.popitem(last=False)


def _digest(path: str) -> str:
    """Return a digest of what a file or folder contains; none for what cannot be read."""
    try:
        is_folder = os.path.isdir(path)
        data = "\0".join(sorted(os.listdir(path))).encode() if is_folder else read_regular(Path(path), _LARGEST)
        return xxh3_128_hexdigest(data)
    except OSError:
        return ""


def _asked(requests: Sequence[XacroRequest]) -> list[XacroAnswer | None]:
    package = str(Path(rbxcompose.__file__).parents[1])
    with subprocess.Popen(
        [sys.executable, "-E", "-s", "-B", "-c", _RUN, package],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,  # xacro warns there of what is deprecated
        env={},
        start_new_session=True,
    ) as process:
        try:
            output, _ = process.communicate(f"[{','.join(one.text for one in requests)}]".encode(), timeout=DEADLINE)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            output = b""
    written = list(_split(output))
    if len(written) != len(requests):
        return [None] * len(requests)
    return [read_answer(one, request.roots) for one, request in zip(written, requests, strict=True)]


def _split(output: bytes) -> Iterator[bytes]:
    """Yield the answers, each of which follows its length."""
    while output:
        end = 8 + int.from_bytes(output[:8], "little")
        yield output[8:end]
        output = output[end:]
