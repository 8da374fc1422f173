"""Verbs for a robot of a system, `--robot SYSTEM` or `--robot SYSTEM:ROBOT`: they run on the hosts that can answer."""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from types import FrameType

from rbxcompose.cli.output.console import FINDINGS, refuse
from rbxcompose.cli.project.kinds import system_and_robot
from rbxcompose.cli.robots.lookup import NotDoneError, find_robot
from rbxcompose.cli.systems.everywhere import Shares, ask, compiled, shares_of
from rbxcompose.cli.systems.options import BUS, EACH
from rbxcompose.cli.systems.parameters import WITH_FILES, RemoteParameters
from rbxcompose.cli.systems.remote import UNREACHED, Remote
from rbxcompose.findings import Finding, kind
from rbxcompose.sdk.registry import component_type
from rbxcompose.systems.model import PlacedRobot, System
from rbxcompose.systems.share import hosts_of

WHICH = kind("RBX6121")
NOBODY_THERE = kind("RBX6122")
SSH_FAILED = 255  # exit code of ssh, if it fails itself
_OF_SYSTEM = ("--ssh-config", "--profile")
_FOR_ONE = ("watch", "echo", "hz", "pub", "call", "send", "static")  # they last, or are meant for one


def forward(written: str, where: str, words: Sequence[str], arguments: argparse.Namespace) -> int:
    """Run the words of a command on the hosts that can answer it; `where` is the `ON_SYSTEM` of its verb."""
    path, name = system_and_robot(written) or (written, "")
    system = compiled(path, arguments)
    if system is None:
        return FINDINGS
    if name and name not in system.robots:
        return refuse(WHICH.misspelt(None, f"the system has no robot '{name}'", name, system.robots, "robots"))
    robots = [one for one in system.robots.values() if name in ("", one.name)]
    chosen = choose(system, robots, where, arguments)
    if isinstance(chosen, Finding):
        return refuse(chosen)
    own = list(_for_there(words))
    action = getattr(arguments, "action", "")
    if len(chosen) == 1:
        ((_, robot), remote), *_ = chosen.items()
        renamed = _renamed(own, written, robot)
        if words[0] == "param" and action in WITH_FILES and not remote.is_here:
            return RemoteParameters(system, system.robots[robot], remote, renamed).run(arguments)
        return _run_there(remote, renamed)
    if words[0] == "top" and not (arguments.json or arguments.once) and sys.stdin.isatty() and sys.stdout.isatty():
        from rbxcompose.cli.systems.top_system import show_system  # only needed on a terminal

        return show_system(system.name, chosen)
    if action in _FOR_ONE or getattr(arguments, "follow", False):
        return refuse(WHICH.at(None, f"'{action}' is for one robot", help=_named(path, robots)))
    if words[0] == "param" and action in WITH_FILES:
        return refuse(WHICH.at(None, f"'param {action}' works with the files of one robot", help=_named(path, robots)))
    in_json = getattr(arguments, "json", False)
    return ask(chosen, lambda robot: _renamed(own, written, robot), in_json=in_json)


def _named(path: str, robots: Sequence[PlacedRobot]) -> str:
    names = " or ".join(f"{path}:{one.name}" for one in robots)
    return f"--robot {names}"


def choose(
    system: System, robots: Sequence[PlacedRobot], where: str, arguments: argparse.Namespace
) -> Shares | Finding:
    """Return the shares of robots that can answer, for an `ON_SYSTEM`."""
    every, chosen = shares_of(system, arguments.ssh_config), dict[tuple[str, str], Remote]()
    for robot in robots:
        hosts = hosts_of(system, robot)
        if where == BUS:
            found = _reachable({host: every[host, robot.name] for host in hosts}, robot.name)
            if isinstance(found, Finding):
                return found
            hosts = [found]
        elif where != EACH:
            hosts = answering(robot, where)
        chosen |= {(host, robot.name): every[host, robot.name] for host in hosts}
    names = ", ".join(one.name for one in robots)
    return chosen or NOBODY_THERE.at(None, f"{names}: no component of type '{where}'")


def answering(robot: PlacedRobot, about: str) -> list[str]:
    """Return the hosts of a robot with a component that answers requests about something."""
    return list(dict.fromkeys(robot.hosts[one.name] for one in robot.plan.instances if _answers(one.type, about)))


def _answers(type_: str, about: str) -> bool:
    return any(request.about == about for request in component_type(type_).requests().types.values())


def _reachable(remotes: dict[str, Remote], robot: str) -> str | Finding:
    """Return a host that reaches the bus of a robot: this machine, else the first one that ssh reaches."""
    problems: list[str] = []
    for host, remote in sorted(remotes.items(), key=lambda one: not one[1].is_here):
        if remote.is_here:
            try:
                find_robot(robot)
                return host
            except NotDoneError as error:
                problems.append(f"'{host}': {error.finding.message}")
                continue
        done = subprocess.run(remote.ssh("true"), capture_output=True, text=True, errors="replace", check=False)
        if done.returncode == 0:
            if problems:
                sys.stderr.write(f"{'; '.join(problems)}; asking '{host}'\n")
            return host
        problems.append(f"'{host}' cannot be reached: {done.stderr.strip()}")
    return UNREACHED.at(None, "; ".join(problems))


def _run_there(remote: Remote, words: Sequence[str]) -> int:
    """Run a command on a host with the terminal of this one; an interrupt is for the command."""

    def leave(number: int, frame: FrameType | None) -> None:
        """Leave it to the command, which gets it, too."""

    has_terminal = sys.stdin.isatty() and sys.stdout.isatty()
    before = signal.signal(signal.SIGINT, leave)
    try:
        code = subprocess.run(remote.rbxcompose(words, has_terminal=has_terminal), check=False).returncode
    finally:
        signal.signal(signal.SIGINT, before)
    if code == SSH_FAILED and not remote.is_here:
        return refuse(UNREACHED.at(None, f"'{remote.name}' cannot be reached: ssh tells why"))
    return code if code >= 0 else 128 - code


def _renamed(words: Sequence[str], written: str, robot: str) -> list[str]:
    """Return words with a robot in place of what was written for it."""
    return [
        robot if word == written else f"--robot={robot}" if word == f"--robot={written}" else word for word in words
    ]


def _for_there(words: Sequence[str]) -> Iterator[str]:
    """Yield words without the options that are for the system."""
    rest = iter(words)
    for word in rest:
        if word in _OF_SYSTEM:
            next(rest, None)
        elif not word.startswith(tuple(f"{one}=" for one in _OF_SYSTEM)):
            yield word
