"""Verbs for a whole system: `up`, `ps`, `logs`, `stop` and `down` on all of its hosts."""

from __future__ import annotations

import argparse
import json
import os
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from types import FrameType

from rbxcompose.cli.output.console import FINDINGS, refuse, tell, tell_report
from rbxcompose.cli.systems.remote import UNREACHED, Remote, Running, on_all, send_all
from rbxcompose.systems.bundle import bundle_of
from rbxcompose.systems.model import System
from rbxcompose.systems.reader import compile_system
from rbxcompose.systems.share import hosts_of

INTERRUPTED = 130
_LOOK = 0.05  # [s] between two looks at what runs
_ENDINGS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
Shares = Mapping[tuple[str, str], Remote]  # by host and robot


def shares_of(system: System, arguments: argparse.Namespace) -> Shares:
    """Return where each share runs."""
    config = arguments.ssh_config
    remotes = {name: Remote(name, host, config) for name, host in system.hosts.items()}
    return {(host, one.name): remotes[host] for one in system.robots.values() for host in hosts_of(system, one)}


def is_reachable(system: System) -> bool:
    """Return whether each host can be told from the others; if not, tell why."""
    here = [name for name, host in system.hosts.items() if host.ssh is None]
    if len(here) > 1:
        message = f"'{here[0]}' and '{here[1]}' have no 'ssh', and only one of them can be this machine"
        refuse(UNREACHED.at(None, message, help=f"give the others 'ssh', or use --host {here[0]} where a verb has it"))
    return len(here) <= 1


def compiled(path: str, *, real: bool = False) -> System | None:
    """Return a system without errors; None after telling them."""
    system = compile_system(path, environment=os.environ, real=real)
    tell_report(system.report, system.sources)
    return None if system.report.has_errors or not is_reachable(system) else system


def up_everywhere(path: str, system: System, arguments: argparse.Namespace) -> int:
    """Bring the files to all hosts, start all shares, and show what they tell until the robots are down."""
    if not is_reachable(system):
        return FINDINGS
    shares = shares_of(system, arguments)
    bundle = bundle_of(system)
    folders = send_all({one.name: one for one in shares.values()}.values(), bundle)
    if isinstance(folders, list):
        return max(map(refuse, folders))
    options = [*(["-d"] if arguments.detach else []), *(["--real"] if arguments.real else [])]
    options += ["--for", f"{arguments.duration} s"] if arguments.duration else []
    commands: dict[str, Sequence[str]] = {}
    for (host, robot), remote in shares.items():
        file = path if remote.is_here else bundle.system
        words = ["up", file, "--host", host, "--robot", robot, *options]
        folder = folders.get(host, "")
        commands[_label(shares, host, robot)] = remote.rbxcompose(
            words, folder=folder, has_terminal=not arguments.detach
        )
    return _follow(commands)


def _label(shares: Shares, host: str, robot: str) -> str:
    several = len({name for _, name in shares}) > 1
    labels = [f"{one} {other}" if several else one for one, other in shares]
    return f"{host} {robot}".ljust(max(map(len, labels))) if several else host.ljust(max(map(len, labels)))


def _follow(commands: Mapping[str, Sequence[str]]) -> int:
    """Run commands at once and show what they print; if one fails, end the others. Return the exit code."""
    interrupts: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        interrupts.append(number)

    before = {number: signal.signal(number, note) for number in _ENDINGS}
    try:
        running = [Running(label, command) for label, command in commands.items()]
        while any(one.poll() is None for one in running):
            if interrupts or any(one.poll() for one in running):
                for one in running:
                    one.end()
            time.sleep(_LOOK)
        codes = [one.wait() for one in running]
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    failed = [code for code in codes if code > 0]
    return INTERRUPTED if interrupts else min(failed, default=0)


def follow_everywhere(path: str, arguments: argparse.Namespace, words: Callable[[str], Sequence[str]]) -> int:
    """Run a verb on each host, for each robot there, and show each line as it comes."""
    system = compiled(path)
    if system is None:
        return FINDINGS
    shares = shares_of(system, arguments)
    return _follow(
        {
            _label(shares, host, robot): remote.rbxcompose(words(robot), has_terminal=True)
            for (host, robot), remote in shares.items()
        }
    )


def ask_everywhere(
    path: str, arguments: argparse.Namespace, words: Callable[[str], Sequence[str]], *, tolerates: str = ""
) -> int:
    """Run a verb on each host, for each robot there, and show what each says; return the highest exit code.

    A finding of the code that it `tolerates` does not count if the verb succeeds on another host.
    """
    system = compiled(path)
    if system is None:
        return FINDINGS
    shares = shares_of(system, arguments)
    done = on_all({f"{host} {robot}": one.rbxcompose(words(robot)) for (host, robot), one in shares.items()})
    codes = {label: abs(one.wait()) for label, one in done.items()}
    if tolerates and 0 in codes.values():
        done = {label: one for label, one in done.items() if not any(tolerates in line for line in one.lines)}
    if arguments.json:
        tell(json.dumps({"hosts": [_data(label, one) for label, one in done.items()]}))
    else:
        tell("\n\n".join("\n".join([f"{label}:", *(f"  {line}" for line in one.lines)]) for label, one in done.items()))
    return max(codes[label] for label in done)


def _data(label: str, one: Running) -> dict[str, object]:
    host, _, robot = label.partition(" ")
    text = "\n".join(one.lines)
    try:
        answer = json.loads(text)
    except ValueError:
        answer = {"text": text}
    return {"host": host, "robot": robot, "exit_code": one.wait(), "answer": answer}
