"""Questions to processes with a fence around each: what evaluates strangers' texts must not run in ours."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import rbxcompose
from rbxcompose.base.processes import processor_time

DEADLINE = 12.0  # [s] of real time, on a busy machine; the processes limit their processor time themselves
_RUN = "import sys; sys.path.insert(0, sys.argv[1]); from {} import main; main()"


def fenced_answers(
    module: str, requests: Sequence[str], environment: Mapping[str, str] | None = None, deadline: float = DEADLINE
) -> list[bytes]:
    """Return what `main` of a module answers to each request, which is JSON; empty where it kept to no limit."""
    package = str(Path(rbxcompose.__file__).parents[1])
    with subprocess.Popen(
        [sys.executable, "-I", "-B", "-c", _RUN.format(module), package],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=dict(environment or {}),
        start_new_session=True,
    ) as process:
        try:
            output, _ = process.communicate(f"[{','.join(requests)}]".encode(), timeout=deadline)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            output = b""
    written = list(_split(output))
    return written if len(written) == len(requests) else [b""] * len(requests)


def _split(output: bytes) -> Iterator[bytes]:
    """Yield the answers, each of which follows its length."""
    while output:
        end = 8 + int.from_bytes(output[:8], "little")
        yield output[8:end]
        output = output[end:]


def answer_all(answer: Callable[[dict[str, Any], float], Any]) -> None:
    """Answer requests, each in a process of its own: the length in 8 bytes and the answer, or 0 if there is none.

    `answer` gets a request and the processor time [s] that a start takes, builds the fence, and returns plain data.
    """
    start = processor_time()
    answers = [_begun(answer, request, start) for request in json.load(sys.stdin)]
    for process, file in answers:
        _, status = os.waitpid(process, 0)
        written = os.pread(file, os.fstat(file).st_size, 0) if status == 0 else b""
        sys.stdout.buffer.write(len(written).to_bytes(8, "little") + written)
    sys.stdout.buffer.flush()


def _begun(answer: Callable[[dict[str, Any], float], Any], request: dict[str, Any], start: float) -> tuple[int, int]:
    """Return the process that answers a request, and the file that it writes the answer to."""
    file = os.memfd_create("answer")  # a file, since its size can be limited
    process = os.fork()
    if process == 0:
        os.closerange(3, file)  # those of other requests
        for standard in (0, 1, 2):
            os.dup2(os.open(os.devnull, os.O_RDWR), standard)
        written = json.dumps(answer(request, start), ensure_ascii=False).encode(errors="replace")
        os._exit(0 if os.write(file, written) == len(written) else 1)
    return process, file
