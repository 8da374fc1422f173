"""Two hosts on one machine: network namespaces with a cable between them, made here and removed at the end."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Self

PATIENCE = 10.0  # [s] for what is asked to end
_OWN_MEMORY = 'mount -t tmpfs tmpfs /dev/shm && exec "$@"'  # hosts share no memory
_NUMBERS = iter(range(1000))


class NotPermittedError(Exception):
    """Raised where namespaces cannot be made, with the reason."""


def _run(*words: str) -> None:
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE, check=False)
    except OSError as error:
        raise NotPermittedError(f"{words[0]} cannot run: {error.strerror}") from error
    if done.returncode:
        raise NotPermittedError(f"{' '.join(words)}: {done.stderr.strip()}")


class TwoHosts:
    """`addresses` by host; each host has a folder, memory and loopback interface of its own."""

    def __init__(self, folder: Path, addresses: Mapping[str, str]) -> None:
        """Make them.

        Raises:
            NotPermittedError: if this user or kernel does not permit it.
        """
        self.folder, self.addresses = folder, addresses
        self._mark = f"{os.getpid() % 100_000}x{next(_NUMBERS)}"
        self._processes: list[subprocess.Popen[str]] = []
        self._made: list[str] = []
        try:
            self._make()
        except NotPermittedError:
            self.remove()
            raise

    def _make(self) -> None:
        for host in self.addresses:
            _run("ip", "netns", "add", self.namespace(host))
            self._made.append(host)
            (self.folder / host / "temporary").mkdir(parents=True)
        one, other = self.addresses
        ends = [("netns", self.namespace(host), "name", self.device(host)) for host in (one, other)]
        _run("ip", "link", "add", "name", ends[0][3], *ends[0][:2], "type", "veth", "peer", *ends[1][2:], *ends[1][:2])
        for host, address in self.addresses.items():
            _run("ip", "-n", self.namespace(host), "addr", "add", f"{address}/24", "dev", self.device(host))
            for device in ("lo", self.device(host)):
                _run("ip", "-n", self.namespace(host), "link", "set", device, "up")
            self.start(host, "true").wait(PATIENCE)

    def namespace(self, host: str) -> str:
        """Return the name of a host's network namespace."""
        return f"rbx{self._mark}{host}"

    def device(self, host: str) -> str:
        """Return the name of a host's end of the cable; the kernel takes 15 characters."""
        return f"v{self._mark}{host}"[:15]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.remove()

    def start(self, host: str, *words: str, environment: Mapping[str, str] | None = None) -> subprocess.Popen[str]:
        """Start a command on a host; what it prints is collected."""
        folder = self.folder / host
        own = {"XDG_RUNTIME_DIR": folder, "TMPDIR": folder / "temporary", "XDG_CONFIG_HOME": folder / "config"}
        process = subprocess.Popen(
            ["ip", "netns", "exec", self.namespace(host), "sh", "-c", _OWN_MEMORY, "sh", *words],
            env={
                **os.environ,
                **{name: str(path) for name, path in own.items()},
                "NO_COLOR": "1",
                **(environment or {}),
            },
            cwd=self.folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._processes.append(process)
        return process

    def cut(self) -> float:
        """Pull the cable; return when [s, monotonic]."""
        self._set_cable("down")
        return time.monotonic()

    def mend(self) -> float:
        """Plug the cable in again; return when [s, monotonic]."""
        self._set_cable("up")
        return time.monotonic()

    def _set_cable(self, state: str) -> None:
        host = next(iter(self.addresses))
        _run("ip", "-n", self.namespace(host), "link", "set", self.device(host), state)

    def pids(self) -> list[int]:
        """Return all processes that run on these hosts."""
        found = [
            subprocess.check_output(["ip", "netns", "pids", self.namespace(host)], text=True) for host in self._made
        ]
        return [int(pid) for text in found for pid in text.split()]

    def remove(self) -> None:
        """End all that still runs on the hosts, and remove them."""
        for process in self._processes:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
        for process in self._processes:
            try:
                process.communicate(timeout=PATIENCE)
            except (subprocess.TimeoutExpired, ValueError):
                process.kill()
        for pid in self.pids():
            os.kill(pid, signal.SIGKILL)
        for host in self._made:
            _run("ip", "netns", "del", self.namespace(host))
        self._made.clear()
