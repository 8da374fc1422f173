"""Verbs for a whole system: `up`, `ps`, `logs`, `stop` and `down` on all of its hosts."""

from __future__ import annotations

import argparse
import json
import os
import signal
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from types import FrameType

from rbxcompose.cli.output.console import FINDINGS, refuse, tell, tell_report
from rbxcompose.cli.systems.remote import UNREACHED, Remote, Running, on_all, send_all
from rbxcompose.systems.bundle import Bundle, bundle_of
from rbxcompose.systems.model import System
from rbxcompose.systems.reader import compile_system
from rbxcompose.systems.share import hosts_of

INTERRUPTED = 130
_LOOK = 0.05  # [s] between two looks at what runs
_ENDINGS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
Shares = Mapping[tuple[str, str], Remote]  # by host and robot


def shares_of(system: System, config: Path | None) -> Shares:
    """Return where each share runs; `config` is that of ssh."""
    remotes = {name: Remote(name, host, config) for name, host in system.hosts.items()}
    return {(host, one.name): remotes[host] for one in system.robots.values() for host in hosts_of(system, one)}


def is_reachable(system: System) -> bool:
    """Return whether each host can be told from the others; if not, tell why."""
    here = [name for name, host in system.hosts.items() if host.ssh is None]
    if len(here) > 1:
        message = f"'{here[0]}' and '{here[1]}' have no 'ssh', and only one of them can be this machine"
        refuse(UNREACHED.at(None, message, help=f"give the others 'ssh', or use --host {here[0]} where a verb has it"))
    return len(here) <= 1


def compiled(path: str, arguments: argparse.Namespace) -> System | None:
    """Return a system without errors; None after telling them. Its warnings are for `check` and `up`."""
    system = compile_system(path, environment=os.environ, profiles=arguments.profile)
    if system.report.has_errors:
        tell_report(system.report, system.sources)
        return None
    return system if is_reachable(system) else None


def up_everywhere(path: str, system: System, arguments: argparse.Namespace) -> int:
    """Bring the files to all hosts, start all shares, and show what they tell until the robots are down."""
    if not is_reachable(system):
        return FINDINGS
    shares = shares_of(system, arguments.ssh_config)
    bundle = bundle_of(system)
    folders = reached(shares, bundle)
    if folders is None:
        return FINDINGS
    shares = {key: one for key, one in shares.items() if one.is_here or one.name in folders}
    options = [*(["-d"] if arguments.detach else []), *(["--real"] if arguments.real else [])]
    options += [word for name in system.profiles for word in ("--profile", name)]
    options += ["--for", f"{arguments.duration} s"] if arguments.duration else []
    commands: dict[str, Sequence[str]] = {}
    for (host, robot), remote in shares.items():
        file = path if remote.is_here else bundle.system
        words = ["up", file, "--host", host, "--robot", robot, *options]
        folder = folders.get(host, "")
        commands[_label(shares, host, robot)] = remote.rbxcompose(
            words, folder=folder, has_terminal=not arguments.detach
        )
    return _follow(commands, [_label(shares, *key) for key, one in shares.items() if one.model.optional])


def reached(shares: Shares, bundle: Bundle, *, needs_all: bool = True) -> dict[str, str] | None:
    """Bring the files to all hosts and return their folders there; None after telling which host has not got them.

    One that is `optional` is told, and left out; so are all unless it `needs_all`.
    """
    folders, is_complete = dict[str, str](), True
    optional = {one.name for one in shares.values() if one.model.optional}
    for name, found in send_all({one.name: one for one in shares.values()}.values(), bundle).items():
        if isinstance(found, str):
            folders[name] = found
        elif name in optional:
            tell(f"without '{name}', which is optional: {found.message}")
        else:
            is_complete = False
            refuse(found)
    return folders if is_complete or not needs_all else None


def _label(shares: Shares, host: str, robot: str) -> str:
    several = len({name for _, name in shares}) > 1
    labels = [f"{one} {other}" if several else one for one, other in shares]
    return f"{host} {robot}".ljust(max(map(len, labels))) if several else host.ljust(max(map(len, labels)))


def _follow(commands: Mapping[str, Sequence[str]], optional: Collection[str] = ()) -> int:
    """Run commands at once and show what they print; if one fails, end the others. Return the exit code.

    Those of the labels that are `optional` may fail.
    """
    interrupts: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        interrupts.append(number)

    before = {number: signal.signal(number, note) for number in _ENDINGS}
    try:
        running = [Running(label, command) for label, command in commands.items()]
        needed = [one for label, one in zip(commands, running, strict=True) if label not in optional]
        while any(one.poll() is None for one in running):
            if interrupts or any(one.poll() for one in needed):
                for one in running:
                    one.end()
            time.sleep(_LOOK)
        for one in running:
            one.wait()
        codes = [one.wait() for one in needed]
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    failed = [code for code in codes if code > 0]
    return INTERRUPTED if interrupts else min(failed, default=0)


def follow_everywhere(path: str, arguments: argparse.Namespace, words: Callable[[str], Sequence[str]]) -> int:
    """Run a verb on each host, for each robot there, and show each line as it comes."""
    system = compiled(path, arguments)
    if system is None:
        return FINDINGS
    return follow(shares_of(system, arguments.ssh_config), words)


def follow(shares: Shares, words: Callable[[str], Sequence[str]]) -> int:
    """Run a verb for each share, and show each line as it comes."""
    return _follow(
        {
            _label(shares, host, robot): remote.rbxcompose(words(robot), has_terminal=True)
            for (host, robot), remote in shares.items()
        }
    )


def ask_everywhere(
    path: str, arguments: argparse.Namespace, words: Callable[[str], Sequence[str]], *, tolerates: str = ""
) -> int:
    """Run a verb on each host, for each robot there, as `ask` does."""
    system = compiled(path, arguments)
    if system is None:
        return FINDINGS
    return ask(shares_of(system, arguments.ssh_config), words, in_json=arguments.json, tolerates=tolerates)


def ask(shares: Shares, words: Callable[[str], Sequence[str]], *, in_json: bool, tolerates: str = "") -> int:
    """Run a verb for each share, and show what each says; return the highest exit code.

    A finding of the code that it `tolerates` does not count if the verb succeeds on another host.
    """
    done = on_all({f"{host} {robot}": one.rbxcompose(words(robot)) for (host, robot), one in shares.items()})
    codes = {label: abs(one.wait()) for label, one in done.items()}
    if tolerates and 0 in codes.values():
        done = {label: one for label, one in done.items() if not any(tolerates in line for line in one.lines)}
    if in_json:
        tell(json.dumps({"hosts": [_data(label, one) for label, one in done.items()]}))
    else:
        tell("\n\n".join("\n".join([f"{label}:", *(f"  {line}" for line in one.lines)]) for label, one in done.items()))
    return max(codes[label] for label in done)


def _data(label: str, one: Running) -> dict[str, object]:
    host, _, robot = label.partition(" ")
    is_one = len(one.lines) == 1 or one.wait() != 0  # what failed has told people, too
    answer = one.answer if is_one else None
    answer = {"text": "\n".join(one.lines)} if answer is None else answer
    return {"host": host, "robot": robot, "exit_code": one.wait(), "answer": answer}
