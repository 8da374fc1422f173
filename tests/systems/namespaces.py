"""Hosts on one machine: network namespaces, each with a cable to a switch, made here and removed at the end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Self

from tests.forked import Forked

SWITCH, DEVICE = "switch", "cable"
PATIENCE = 10.0  # [s] for what is asked to end
_OWN_MEMORY = 'mount -t tmpfs tmpfs /dev/shm && exec "$@"'  # hosts share no memory
_INSIDE = str(Path(__file__).with_name("inside.py"))
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


class Hosts:
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
        for host in (SWITCH, *self.addresses):
            _run("ip", "netns", "add", self.namespace(host))
            self._made.append(host)
        self.ip(SWITCH, "link", "add", "switch", "type", "bridge")
        self.ip(SWITCH, "link", "set", "switch", "up")
        for host, address in self.addresses.items():
            (self.folder / host / "temporary").mkdir(parents=True, exist_ok=True)
            there = ("peer", "name", host, "netns", self.namespace(SWITCH))
            _run("ip", "link", "add", DEVICE, "netns", self.namespace(host), "type", "veth", *there)
            self.ip(SWITCH, "link", "set", "dev", host, "master", "switch", "up")
            self.ip(host, "addr", "add", f"{address}/24", "dev", DEVICE)
            for device in ("lo", DEVICE):
                self.ip(host, "link", "set", device, "up")
            self.start(host, "true").wait(PATIENCE)

    def ip(self, host: str, *words: str) -> None:
        """Run `ip` on a host, or on the switch."""
        _run("ip", "-n", self.namespace(host), *words)

    def namespace(self, host: str) -> str:
        """Return the name of a host's network namespace."""
        return f"rbx{self._mark}{host}"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.remove()

    def start(self, host: str, *words: str, environment: Mapping[str, str] | None = None) -> subprocess.Popen[str]:
        """Start a command on a host; what it prints is collected."""
        folder = self.folder / host
        own = {"XDG_RUNTIME_DIR": folder, "TMPDIR": folder / "temporary", "XDG_CONFIG_HOME": folder / "config"}
        namespace, python = self.namespace(host), (sys.executable, "-m")
        command = ["ip", "netns", "exec", namespace, "sh", "-c", _OWN_MEMORY, "sh", *words]
        # Any other variable, such as `LD_PRELOAD`, may be for the start itself.
        is_forked = words[:2] == python and not (environment or {}).keys() - {"PYTHONPATH"}
        process = (Forked if is_forked else subprocess.Popen)(
            [sys.executable, _INSIDE, namespace, *words[2:]] if is_forked else command,
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

    def cut(self, host: str) -> float:
        """Pull the cable of a host; return the time just before [s, monotonic]."""
        before = time.monotonic()
        self.ip(host, "link", "set", DEVICE, "down")
        return before

    def mend(self, host: str) -> float:
        """Plug the cable of a host in again; return when [s, monotonic]."""
        self.ip(host, "link", "set", DEVICE, "up")
        return time.monotonic()

    def slow_down(self, host: str, *words: str) -> None:
        """Delay, lose or limit what a host sends, in the words of `tc`.

        Raises:
            NotPermittedError: if this kernel cannot.
        """
        _run("tc", "-n", self.namespace(host), "qdisc", "replace", "dev", DEVICE, "root", *words)

    def pids(self, host: str) -> list[int]:
        """Return all processes that run on a host."""
        text = subprocess.check_output(["ip", "netns", "pids", self.namespace(host)], text=True)
        return [int(pid) for pid in text.split()]

    def freeze(self, host: str) -> float:
        """Let nothing on a host run any more; return the time just before [s, monotonic]."""
        before = time.monotonic()
        for pid in self.pids(host):
            os.kill(pid, signal.SIGSTOP)
        return before

    def thaw(self, host: str) -> None:
        """Let all on a host go on."""
        for pid in self.pids(host):
            os.kill(pid, signal.SIGCONT)

    def remove(self) -> None:
        """End all that still runs on the hosts, and remove them."""
        for process in self._processes:
            if process.poll() is None:
                process.terminate()
        for process in self._processes:
            try:
                process.communicate(timeout=PATIENCE)
            except (subprocess.TimeoutExpired, ValueError):
                process.kill()
                process.communicate()
        for pid in [pid for host in self._made for pid in self.pids(host)]:
            os.kill(pid, signal.SIGKILL)
        for host in self._made:
            _run("ip", "netns", "del", self.namespace(host))
        self._made.clear()
