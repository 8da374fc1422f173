"""Commands on the hosts of a system: over ssh, as ssh's own configuration knows them, or on this machine."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
import threading
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

from rbxcompose import __version__
from rbxcompose.cli.output.console import tell
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, kind
from rbxcompose.manifest.system_file import HostModel
from rbxcompose.printable import plain
from rbxcompose.systems.bundle import Bundle

UNREACHED = kind("RBX6113")
OTHER_VERSION = kind("RBX6114")
AT_ONCE = 16  # commands whose answers are awaited, so that a fleet does not need a machine of its own
CONNECT = 10  # [s] to reach a host
_UNPACK = """set -e
d="${XDG_CACHE_HOME:-$HOME/.cache}/rbxcompose/systems/DIGEST"
if [ -d "$d" ]; then cat > /dev/null
else t="$d.$$"; mkdir -p "$t"; tar -xf - -C "$t"; mv "$t" "$d" 2> /dev/null || rm -rf "$t"; fi
printf 'folder %s\\n' "$d"
COMMAND --version
"""


@dataclass(frozen=True, slots=True)
class Remote:
    """A host, as a place to run commands; without `ssh` in its model, it is this machine."""

    name: str
    model: HostModel
    config: Path | None = None  # of ssh, instead of the user's

    @property
    def is_here(self) -> bool:
        """Return whether it is this machine."""
        return self.model.ssh is None

    def rbxcompose(self, words: Sequence[str], *, folder: str = "", has_terminal: bool = False) -> list[str]:
        """Return the command that runs rbxcompose there; with a terminal, it ends when the connection does."""
        if self.is_here:
            return [sys.executable, "-m", "rbxcompose", *words]
        command = f"NO_COLOR=1 exec {shlex.join([self.model.command, *words])}"  # its lines stand behind ours
        return self.ssh(f"cd {shlex.quote(folder)} && {command}" if folder else command, has_terminal=has_terminal)

    def ssh(self, script: str, *, has_terminal: bool = False) -> list[str]:
        """Return the command that runs a script of the shell there."""
        own = ["-F", str(self.config)] if self.config else []
        settings = ("BatchMode=yes", f"ConnectTimeout={CONNECT}", "ServerAliveInterval=5", "LogLevel=ERROR")
        options = [word for one in settings for word in ("-o", one)]
        return ["ssh", *own, *options, "-tt" if has_terminal else "-T", "--", self.model.ssh or "", script]


def send(remote: Remote, bundle: Bundle) -> str | Finding:
    """Bring a bundle to a host, unless it has it already; return its folder there."""
    script = _UNPACK.replace("DIGEST", bundle.digest).replace("COMMAND", shlex.quote(remote.model.command))
    try:
        done = subprocess.run(remote.ssh(script), input=bundle.archive, capture_output=True, check=False)
    except OSError as error:
        return UNREACHED.at(None, f"'{remote.name}' cannot be reached: ssh cannot run: {error.strerror}")
    told = done.stdout.decode(errors="replace").splitlines()
    folder = next((line.removeprefix("folder ") for line in told if line.startswith("folder ")), "")
    if not folder:
        return UNREACHED.at(None, f"'{remote.name}' cannot be reached: {_last(done.stderr)}")
    version = next((line.removeprefix("rbxcompose ") for line in told if line.startswith("rbxcompose ")), "")
    if done.returncode or version != __version__:
        found = f"rbxcompose {plain(version)}" if version else f"no rbxcompose that runs: {_last(done.stderr)}"
        return OTHER_VERSION.at(None, f"'{remote.name}' has {found}; this machine has {__version__}")
    return folder


def _last(stderr: bytes) -> str:
    lines = stderr.decode(errors="replace").strip().splitlines()
    return plain(lines[-1]) if lines else "no reason is told"


def send_all(remotes: Iterable[Remote], bundle: Bundle) -> dict[str, str | Finding]:
    """Bring a bundle to all hosts at once; return its folder on each, or why it is not there."""
    away = [one for one in remotes if not one.is_here]
    with ThreadPoolExecutor() as pool:
        return dict(zip((one.name for one in away), pool.map(lambda one: send(one, bundle), away), strict=True))


class Running:
    """A command on a host whose output is shown line by line, each with the name of the host."""

    def __init__(self, label: str, command: Sequence[str], *, shows: bool = True) -> None:
        self._label, self._shows = label, shows
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            start_new_session=True,  # an interrupt is for us, who pass it on
        )
        self.lines: list[str] = []
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        for line in self._process.stdout or ():
            self.lines.append(text := line.rstrip("\r\n"))
            if self._shows:
                tell(f"{self._label} | {plain(text)}")
        if self._process.stdout is not None:
            self._process.stdout.close()

    def poll(self) -> int | None:
        """Return the exit code if it has ended."""
        return self._process.poll()

    def wait(self) -> int:
        """Wait for its end and return the exit code."""
        code = self._process.wait()
        self._thread.join()
        return code

    @property
    def answer(self) -> Any:
        """Return the last line that is JSON, as data; None if there is none. Others are told beside it."""
        for line in reversed(self.lines):
            with suppress(ValueError):
                return json.loads(line)
        return None

    def end(self) -> None:
        """Ask it to end: a command over ssh loses its terminal, which brings what it runs down."""
        if self._process.poll() is None:
            self._process.terminate()


def on_all(commands: Mapping[str, Sequence[str]]) -> dict[str, Running]:
    """Run commands, each by its label, some at once, and wait for all; nothing is shown."""

    def run(label: str) -> Running:
        running = Running(label, commands[label], shows=False)
        running.wait()
        return running

    with ThreadPoolExecutor(AT_ONCE) as pool:
        return dict(zip(commands, pool.map(run, commands), strict=True))
