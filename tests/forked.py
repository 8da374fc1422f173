"""Programs in processes of their own, forked from one that has imported the package: that saves most of a start.

A program does the same as it does when Python starts it, and its process is a child of the test's, as one of `Popen`
is. What is about the start itself, or needs packages that are installed for it, is not for this.
"""

from __future__ import annotations

import atexit
import ctypes
import json
import os
import runpy
import socket
import subprocess
import sys
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from threading import Lock
from typing import Any, NoReturn

from setproctitle import getproctitle

from rbxcompose.commands.main import main as command
from rbxcompose.commands.verbs import load
from rbxcompose.compiler.compile import compile_robot

ROOT = Path(__file__).parents[1]
RBXCOMPOSE = [sys.executable, "-m", "rbxcompose"]
VERBS = ("action", "body", "diag", "down", "mission", "mux", "param", "ps", "service", "tf", "top", "topic", "up")
MODULES = ("rbxcompose.bus.zenoh_transport", "rbxcompose.commands.guest", "rbxcompose.runtime.supervision.launch")
"""Both are imported before; other programs have more to do."""
_MOST = 1 << 17  # [B] of an order
_ADOPTS_ORPHANS = 36  # of prctl(2): processes whose parent has ended become children of this one
_STARTING = Lock()
_LIBC = ctypes.CDLL(None, use_errno=True)


class Forked(subprocess.Popen[str]):
    """A process as `Popen` starts it; its words are `RBXCOMPOSE` with arguments, or Python with a script of tests."""

    def _execute_child(self, *given: Any) -> None:
        """Have it forked: `Popen` leaves to this method what differs between systems."""
        words, _, prepare, _, passed, folder, environment, _, _, _, *pipes = given
        assert (prepare, tuple(passed)) == (None, ()), "nothing but pipes is handed on"
        order = {"words": words[1:], "folder": str(folder), "environment": dict(environment), "leads": given[-2]}
        ends = [pipes[end] if pipes[end] >= 0 else number for number, end in enumerate((0, 3, 5))]
        with _STARTING:
            _LIBC.prctl(_ADOPTS_ORPHANS, 1, 0, 0, 0)
            socket.send_fds(_server(), [json.dumps(order).encode()], ends)
            self.pid = int(_server().recv(_MOST))
            _LIBC.prctl(_ADOPTS_ORPHANS, 0, 0, 0, 0)
        self._child_created = True
        self._close_pipe_fds(*pipes[:6])  # type: ignore[attr-defined]


def run_command(
    words: tuple[str, ...], environment: Mapping[str, str], timeout: float, folder: Path = ROOT
) -> subprocess.CompletedProcess[str]:
    """Run `rbxcompose` with these words, as `subprocess.run` does; where it finds other packages, Python starts it.

    Raises:
        subprocess.TimeoutExpired: if it takes longer than `timeout` [s]; it is killed then.
    """
    pipe = subprocess.PIPE
    command = [*RBXCOMPOSE, *words]
    has_more = environment.get("PYTHONPATH", str(ROOT)) != str(ROOT)
    with (subprocess.Popen if has_more else Forked)(
        command, env=environment, cwd=folder, stdin=subprocess.DEVNULL, stdout=pipe, stderr=pipe, text=True
    ) as process:
        try:
            out, err = process.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            process.kill()
            raise
    return subprocess.CompletedProcess(command, process.returncode, out, err)


@cache
def _server() -> socket.socket:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs:
        number = str(theirs.fileno())
        server = subprocess.Popen([sys.executable, "-m", "tests.forked", number], pass_fds=[theirs.fileno()], cwd=ROOT)
    atexit.register(server.wait)
    atexit.register(ours.close)
    return ours


def main() -> None:
    """Fork a process for each order until nobody is left to give one; answer with its number."""
    for verb in VERBS:
        load(verb)
    for module in MODULES:
        import_module(module)
    compile_robot("robots/turtlebot", environment={})  # imports what a robot is made of
    getproctitle()  # which finds the words of this process while the environment is where it was
    orders = socket.socket(fileno=int(sys.argv[1]))
    while True:
        text, ends, _, _ = socket.recv_fds(orders, _MOST, 3)
        if not text:
            return
        reading, writing = os.pipe()
        between = os.fork()  # whose end makes the process a child of the one that has asked
        if not between:
            if child := os.fork():
                os.write(writing, str(child).encode())
                os._exit(0)
            for number in (reading, writing, orders.detach()):
                os.close(number)
            become(json.loads(text), ends)
        for number in (writing, *ends):
            os.close(number)
        os.waitpid(between, 0)
        orders.send(os.read(reading, _MOST))
        os.close(reading)


def become(order: dict[str, Any], ends: list[int]) -> NoReturn:
    """Take over what a new process has, and be the program."""
    os.chdir(order["folder"])
    os.environ.clear()
    os.environ.update(order["environment"])
    for number, end in enumerate(ends):
        os.dup2(end, number)
        os.close(end)
    sys.stdout = os.fdopen(1, "w", closefd=False)  # what is known of the former ends does not hold
    sys.stderr = os.fdopen(2, "w", buffering=1, errors="backslashreplace", closefd=False)
    if order["leads"]:
        os.setsid()
    first, *words = order["words"]
    if first == "-m":
        sys.argv, sys.path[0] = words, order["folder"]
        sys.exit(command())
    sys.argv, sys.path[0] = [first, *words], str(Path(first).parent)
    runpy.run_path(first, run_name="__main__")
    sys.exit()


if __name__ == "__main__":
    main()
