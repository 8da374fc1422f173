"""Commands in processes of their own, forked from one that has imported the package: that saves nine tenths of a start.

A command does the same as it does when Python starts it. What is about the start itself, or lasts, is not for this.
"""

from __future__ import annotations

import atexit
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from threading import Lock

from rbxcompose.commands.main import main as command
from rbxcompose.commands.verbs import load

ROOT = Path(__file__).parents[1]
VERBS = ("action", "body", "diag", "down", "mission", "mux", "param", "ps", "service", "tf", "top", "topic")
"""Those that are imported before; others have more to do."""
_SENDING = Lock()


def run_command(
    words: tuple[str, ...], environment: Mapping[str, str], timeout: float
) -> subprocess.CompletedProcess[str]:
    """Run `rbxcompose` with these words in the root of the repository; several threads may.

    Raises:
        subprocess.TimeoutExpired: if it takes longer than `timeout` [s]; it is killed then.
    """
    with tempfile.TemporaryDirectory() as folder:
        order = json.dumps({"words": words, "environment": dict(environment), "folder": folder})
        status, out, err = (Path(folder, name) for name in ("status", "out", "err"))
        os.mkfifo(status)
        reading = os.open(status, os.O_RDWR)  # so that it does not end before it has begun
        try:
            with _SENDING:
                server = _server()
                assert server.stdin
                server.stdin.write(f"{order}\n")
                server.stdin.flush()
            told = b""
            while told.count(b"\n") < 2:
                if not select.select([reading], [], [], timeout)[0]:
                    for child in map(int, told.split()[:1]):
                        os.kill(child, signal.SIGKILL)
                    raise subprocess.TimeoutExpired(words, timeout)
                told += os.read(reading, 100)
        finally:
            os.close(reading)
        code = int(told.split()[1])
        return subprocess.CompletedProcess(list(words), code, out.read_text("utf-8"), err.read_text("utf-8"))


@cache
def _server() -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "tests.forked"]
    server = subprocess.Popen(command, stdin=subprocess.PIPE, text=True, cwd=ROOT)
    atexit.register(server.communicate)
    return server


def main() -> None:
    """Fork a process for each line, which waits for the command and says its number and how it ended."""
    for verb in VERBS:
        load(verb)
    for module in ("rbxcompose.bus.zenoh_transport", "rbxcompose.commands.guest"):
        import_module(module)  # which verbs import when they need them
    for line in sys.stdin:
        while _reaped():
            pass
        if os.fork():
            continue
        order = json.loads(line)
        folder = Path(order["folder"])
        with open(folder / "status", "w", encoding="utf-8") as told:
            if not (child := os.fork()):
                _become(order["environment"], folder)
                sys.argv = ["rbxcompose", *order["words"]]
                sys.exit(command())
            print(child, file=told, flush=True)
            _, status = os.waitpid(child, 0)
            print(os.waitstatus_to_exitcode(status), file=told, flush=True)
        os._exit(0)


def _reaped() -> bool:
    try:
        return os.waitpid(-1, os.WNOHANG)[0] > 0
    except ChildProcessError:
        return False


def _become(environment: dict[str, str], folder: Path) -> None:
    """Take over what a new process has: variables, and files for input and output."""
    os.environ.clear()
    os.environ.update(environment)
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    for number, name in ((1, "out"), (2, "err")):
        file = os.open(folder / name, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
        os.dup2(file, number)
        os.close(file)
    os.close(null)


if __name__ == "__main__":
    main()
