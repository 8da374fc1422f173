"""Run a verb on the hosts of a system, and merge their answers."""

from __future__ import annotations

import argparse
import json
import os
import shlex
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from itertools import count
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

from rbxcompose import __version__
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import alone_in, read_regular, replace_file
from rbxcompose.base.findings import Finding, kind
from rbxcompose.base.printable import plain
from rbxcompose.commands.console import (
    INTERRUPTED,
    NotDoneError,
    ReportedError,
    emit,
    handling,
    noted_interrupts,
    refuse,
    write_report,
)
from rbxcompose.commands.lookup import NOT_UP, find_robot
from rbxcompose.commands.options import BUS, EACH, system_and_robot
from rbxcompose.runtime.folder import is_starting, made_base, system_record

if TYPE_CHECKING:  # verbs that may be for a system import this module, most often for a robot
    from rbxcompose.compiler.systems.bundle import Bundle
    from rbxcompose.compiler.systems.model import PlacedRobot, System
    from rbxcompose.manifest.system_file import HostModel

UNREACHED = kind("RBX6113")
OTHER_VERSION = kind("RBX6114")
WHICH = kind("RBX6121")
NOBODY_THERE = kind("RBX6122")
AT_ONCE = 16  # commands whose answers are awaited, so that a fleet does not need a machine of its own
CONNECT = 10  # [s] to reach a host
_LOOK = 0.05  # [s] between two looks at what runs
SSH_FAILED = 255  # exit code of ssh, if it fails itself
_OF_SYSTEM = ("--ssh-config", "--profile")
_LASTING = ("watch", "echo")  # actions that go on until an interrupt, which show one host alone
_LARGEST = 16_000_000  # [B] of what is kept of a system
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
    is_former: bool = False  # its share was brought up from here, and the system has that no longer

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
        options = [word for setting in settings for word in ("-o", setting)]
        return ["ssh", *own, *options, "-tt" if has_terminal else "-T", "--", self.model.ssh or "", script]


def send(remote: Remote, bundle: Bundle) -> str | Finding:
    """Bring a bundle to a host, unless it has it already; return its folder there."""
    script = _UNPACK.replace("DIGEST", bundle.digest).replace("COMMAND", shlex.quote(remote.model.command))
    try:
        done = subprocess.run(remote.ssh(script), input=bundle.archive, capture_output=True, check=False)
    except OSError as error:
        return UNREACHED.at(None, f"'{remote.name}' cannot be reached: ssh cannot run: {error.strerror}")
    lines = done.stdout.decode(errors="replace").splitlines()
    folder = next((line.removeprefix("folder ") for line in lines if line.startswith("folder ")), "")
    if not folder:
        return UNREACHED.at(None, f"'{remote.name}' cannot be reached: {_last(done.stderr)}")
    version = next((line.removeprefix("rbxcompose ") for line in lines if line.startswith("rbxcompose ")), "")
    if done.returncode or version != __version__:
        found = f"rbxcompose {plain(version)}" if version else f"no rbxcompose that runs: {_last(done.stderr)}"
        return OTHER_VERSION.at(None, f"'{remote.name}' has {found}; this machine has {__version__}")
    return folder


def _last(stderr: bytes) -> str:
    lines = stderr.decode(errors="replace").strip().splitlines()
    return plain(lines[-1]) if lines else "no reason given"


def send_all(remotes: Iterable[Remote], bundle: Bundle) -> dict[str, str | Finding]:
    """Bring a bundle to all hosts at once; return its folder on each, or why it is not there."""
    away = [remote for remote in remotes if not remote.is_here]
    with ThreadPoolExecutor() as pool:
        found = pool.map(lambda remote: send(remote, bundle), away)
        return {remote.name: result for remote, result in zip(away, found, strict=True)}


class Running:
    """A command on a host; each line of its output is given to `take`, or kept in `lines`."""

    def __init__(self, command: Sequence[str], take: Callable[[str], None] | None = None) -> None:
        self.lines: list[str] = []
        self._take = take or self.lines.append
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            start_new_session=True,  # an interrupt is for us, who pass it on
        )
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        for line in self._process.stdout or ():
            self._take(line.rstrip("\r\n"))
        if self._process.stdout is not None:
            self._process.stdout.close()

    @property
    def is_over(self) -> bool:
        """Return whether all of its output has been read."""
        return not self._thread.is_alive()

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
        """Return the last line that is JSON, as data; None if there is none. Others are shown beside it."""
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
        running = Running(commands[label])
        running.wait()
        return running

    with ThreadPoolExecutor(AT_ONCE) as pool:
        return dict(zip(commands, pool.map(run, commands), strict=True))


Shares = Mapping[tuple[str, str], Remote]  # by host and robot


def shares_of(system: System, config: Path | None) -> Shares:
    """Return where each share runs; `config` is that of ssh."""
    from rbxcompose.compiler.systems.share import hosts_of

    remotes = {name: Remote(name, host, config) for name, host in system.hosts.items()}
    return {(host, robot.name): remotes[host] for robot in system.robots.values() for host in hosts_of(system, robot)}


def require_reachable(system: System) -> None:
    """Require that each host can be distinguished from the others.

    Raises:
        NotDoneError: if two could be this machine.
    """
    here = [name for name, host in system.hosts.items() if host.ssh is None]
    if len(here) > 1:
        message = f"'{here[0]}' and '{here[1]}' have no 'ssh', and only one of them can be this machine"
        help_text = f"give the others 'ssh', or use --host {here[0]} where a verb has it"
        raise NotDoneError(UNREACHED.at(None, message, help=help_text))


def compiled(path: str, arguments: argparse.Namespace, *, needs_all: bool = True) -> tuple[System, Shares]:
    """Return a system, and where each of its shares runs. Its warnings are for `check` and `up`.

    Unless a verb `needs_all`, names and hosts are enough, so that nobody who edits a file keeps others from stopping
    robots: shares that were brought up from here and that the system has no longer are among them. With errors, shares
    are where they were brought up from here; those of other robots may be on any host.

    Raises:
        ReportedError: if it has errors, and all is needed or nothing is known of its robots.
    """
    from rbxcompose.compiler.systems.reader import compile_system

    system = compile_system(path, environment=os.environ, profiles=arguments.profile)
    if not system.report.has_errors:
        require_reachable(system)
        every = shares_of(system, arguments.ssh_config)
        return system, every if needs_all else {**every, **former(path, every, arguments.ssh_config)}
    shares = {} if needs_all else _known_shares(path, system, arguments.ssh_config)
    if not shares:
        write_report(system.report, system.sources)
        raise ReportedError
    where = ", ".join(dict.fromkeys(host for host, _ in shares))
    where += "" if system.labels else "; others that it may have are not reached"
    sys.stderr.write(f"'{path}' has errors, which 'check' shows; its robots were brought up, or may be, on: {where}\n")
    return system, shares


def _known_shares(path: str, system: System, config: Path | None) -> Shares:
    """Return where robots of a system with errors were brought up, or else may be."""
    shares = recalled(path, config)
    lacking = system.labels.keys() - {robot for _, robot in shares}
    remotes = [Remote(name, host, config) for name, host in system.hosts.items()]
    return shares | {(remote.name, name): remote for name in system.labels if name in lacking for remote in remotes}


def recalled(path: str, config: Path | None) -> dict[tuple[str, str], Remote]:
    """Return where shares of a system were brought up from this machine since its start, as `remember` has kept it."""
    from rbxcompose.manifest.system_file import HostModel

    try:
        made_base()  # nobody else may have written into it
        found = json.loads(read_regular(system_record(path), _LARGEST))
        return {(host, robot): Remote(host, HostModel.model_validate(model), config) for host, robot, model in found}
    except (OSError, ValueError):  # nothing is kept, or not as this version does
        return {}


def former(path: str, every: Shares, config: Path | None) -> Shares:
    """Return the shares that were brought up from here and that a system with `every` of these has no longer."""
    gone = {key: remote for key, remote in recalled(path, config).items() if key not in every}
    return {key: Remote(remote.name, remote.model, config, is_former=True) for key, remote in gone.items()}


def remember(path: str, shares: Shares, gone: Collection[tuple[str, str]] = ()) -> None:
    """Keep where shares of a system are brought up, for `compiled`, without those that are `gone`."""
    with suppress(OSError), alone_in(made_base()):  # without it they are stopped by their names
        kept = {key: share for key, share in (recalled(path, None) | dict(shares)).items() if key not in gone}
        text = json.dumps([(*key, share.model.model_dump()) for key, share in kept.items()])
        replace_file(system_record(path), text.encode(), mode=0o600)


def reached(shares: Shares, bundle: Bundle, *, needs_all: bool = True) -> dict[str, str]:
    """Bring the files to all hosts and return their folders there.

    A host that is `optional` is reported, and left out; so are all unless it `needs_all`.

    Raises:
        ReportedError: if a host did not get them.
    """
    folders, is_complete = dict[str, str](), True
    optional = {share.name for share in shares.values() if share.model.optional}
    for name, found in send_all({share.name: share for share in shares.values()}.values(), bundle).items():
        if isinstance(found, str):
            folders[name] = found
        elif name in optional:
            emit(f"without '{name}', which is optional: {found.message}")
        else:
            is_complete = False
            refuse(found)
    if needs_all and not is_complete:
        raise ReportedError
    return folders


def label_of(shares: Shares, host: str, robot: str) -> str:
    """Return what stands before the lines of a share: its host, and its robot if there are several."""
    several = len({name for _, name in shares}) > 1
    labels = [f"{text} {other}" if several else text for text, other in shares]
    return f"{host} {robot}".ljust(max(map(len, labels))) if several else host.ljust(max(map(len, labels)))


def follow_commands(
    commands: Mapping[str, Sequence[str]],
    optional: Collection[str] = (),
    begun: Callable[[], None] = lambda: None,
    *,
    ends_all: bool = True,
) -> int:
    """Run commands at once and show what they print; if one fails, it `ends_all`. Return the exit code.

    Those of the labels that are `optional` may fail. Once each has printed something, all have `begun`.
    """
    silent = {*commands}

    def show(label: str, line: str) -> None:
        silent.discard(label)
        if not silent:
            begun()
        emit(f"{label} | {plain(line)}")

    with noted_interrupts() as interrupts:
        running = [Running(command, partial(show, label)) for label, command in commands.items()]
        needed = [one for label, one in zip(commands, running, strict=True) if label not in optional]
        while any(item.poll() is None for item in running):
            if interrupts or (ends_all and any(item.poll() for item in needed)):
                for one in running:
                    one.end()
            time.sleep(_LOOK)
        for one in running:
            one.wait()
        codes = [item.wait() for item in needed]
    failed = [code for code in codes if code > 0]
    return INTERRUPTED if interrupts else min(failed, default=0)


def follow_all(shares: Shares, words: Callable[[str], Sequence[str]]) -> int:
    """Run a verb for each share, and show each line as it comes; those that fail leave the others alone."""
    commands = {
        label_of(shares, host, robot): remote.rbxcompose(words(robot), has_terminal=True)
        for (host, robot), remote in shares.items()
    }
    former = [label_of(shares, *key) for key, share in shares.items() if share.is_former]
    return follow_commands(commands, former, ends_all=False)


def ask_all(shares: Shares, words: Callable[[str], Sequence[str]], *, in_json: bool, tolerates: str = "") -> int:
    """Run a verb for each share, and show what each says; return the highest exit code.

    A finding of the code that it `tolerates` does not count if the verb succeeds on another host, nor that a share is
    not up which the system has no longer. While an `up` is on its way here, hosts with that finding are asked again.
    """
    left = {f"{host} {robot}": share.rbxcompose(words(robot)) for (host, robot), share in shares.items()}
    done = dict[str, Running]()
    for tries in count():
        may_change = tolerates and is_starting()
        done |= on_all(left)
        lacking = [label for label in left if may_change and any(tolerates in line for line in done[label].lines)]
        left = {label: left[label] for label in lacking}
        if not left:
            break
        if not tries:
            sys.stderr.write(f"an 'up' is on its way here: asks again for {', '.join(left)}\n")
    codes, not_up = {label: abs(entry.wait()) for label, entry in done.items()}, list[str]()
    if 0 in codes.values():
        counts = {" ".join(key): NOT_UP.code if share.is_former else tolerates for key, share in shares.items()}
        done = {
            label: entry
            for label, entry in done.items()
            if not (code := counts[label]) or not any(code in line for line in entry.lines)
        }
        not_up = [" ".join(key) for key, share in shares.items() if " ".join(key) not in done and not share.is_former]
    if in_json:
        emit(json.dumps({"hosts": [_data(label, entry) for label, entry in done.items()]}))
    else:
        texts = ["\n".join([f"{label}:", *(f"  {line}" for line in entry.lines)]) for label, entry in done.items()]
        texts += [f"{label}:\n  is not up" for label in not_up]
        emit("\n\n".join(texts))
    return max(codes[label] for label in done)


def _data(label: str, one: Running) -> dict[str, object]:
    host, _, robot = label.partition(" ")
    is_one = len(one.lines) == 1 or one.wait() != 0  # what failed has written for people, too
    answer = one.answer if is_one else None
    answer = {"text": "\n".join(one.lines)} if answer is None else answer
    return {"host": host, "robot": robot, "exit_code": one.wait(), "answer": answer}


@dataclass(frozen=True, slots=True)
class SystemCommand:
    """A command for robots of a system: the shares that can answer it, and its words for them."""

    system: System
    path: str
    robots: Sequence[str]
    shares: Shares
    words: Sequence[str]
    written: str  # in the words, for the robot
    arguments: argparse.Namespace

    def words_for(self, robot: str) -> list[str]:
        """Return the words with a robot in place of what was written for it."""
        written, option = self.written, f"--robot={self.written}"
        return [robot if word == written else f"--robot={robot}" if word == option else word for word in self.words]

    def refuse(self, message: str) -> int:
        """Tell that one robot has to be named, and return the exit code."""
        names = " or ".join(f"{self.path}:{robot}" for robot in self.robots)
        return refuse(WHICH.at(None, message, help=f"--robot {names}"))

    def ask(self, *, tolerates: str = "") -> int:
        """Run it for each share, as `ask_all` does; if files have errors, a robot need not be up where it may be."""
        tolerates = NOT_UP.code if self.system.report.has_errors else tolerates
        in_json = getattr(self.arguments, "json", False)
        return ask_all(self.shares, self.words_for, in_json=in_json, tolerates=tolerates)

    def run(self, verb: object) -> int:
        """Run it where it can be answered, and return the exit code.

        A verb that needs more than the same words there has `run_on_system(command) -> int | None`.
        """
        own: Callable[[SystemCommand], int | None] = getattr(verb, "run_on_system", lambda command: None)
        if (exit_code := own(self)) is not None:
            return exit_code
        action = getattr(self.arguments, "action", "")
        if len(self.shares) == 1:
            ((_, robot), remote), *_ = self.shares.items()
            return _run_there(remote, self.words_for(robot))
        is_for_all = getattr(verb, "ON_SYSTEM", "") == EACH or action in getattr(verb, "FOR_ALL", ())
        is_lasting = action in _LASTING or getattr(self.arguments, "follow", False)
        if is_lasting or (not is_for_all and len({robot for _, robot in self.shares}) > 1):
            return self.refuse(f"'{f'{self.words[0]} {action}'.rstrip()}' is for one robot")
        return self.ask()


def forward(verb: object, written: str, where: str, words: Sequence[str], arguments: argparse.Namespace) -> int:
    """Run the words of a command on the hosts that can answer it; `where` is the `ON_SYSTEM` of its verb."""
    path, name = system_and_robot(written) or (written, "")
    system, every = compiled(path, arguments, needs_all=where != EACH)
    names = list(dict.fromkeys(robot for _, robot in every))
    if name and name not in names:
        return refuse(WHICH.misspelt(None, f"the system has no robot '{name}'", name, names, "robots"))
    robots = [robot for robot in names if name in ("", robot)]
    chosen: Shares = {key: share for key, share in every.items() if key[1] in robots}
    chosen = chosen if where == EACH else choose([system.robots[robot] for robot in robots], chosen, where)
    return SystemCommand(system, path, robots, chosen, list(_for_there(words)), written, arguments).run(verb)


def choose(robots: Sequence[PlacedRobot], every: Shares, where: str) -> Shares:
    """Return those of the shares of robots that can answer, for an `ON_SYSTEM` other than `EACH`.

    Raises:
        NotDoneError: if none can.
    """
    chosen = dict[tuple[str, str], Remote]()
    for robot in robots:
        own = {host: share for (host, name), share in every.items() if name == robot.name}
        hosts = [_reachable(own, robot.name)] if where == BUS else answering(robot, where)
        chosen |= {(host, robot.name): own[host] for host in hosts}
    if not chosen:
        names = ", ".join(placed_robot.name for placed_robot in robots)
        raise NotDoneError(NOBODY_THERE.at(None, f"{names}: no component of type '{where}'"))
    return chosen


def answering(robot: PlacedRobot, about: str) -> list[str]:
    """Return the hosts of a robot with a component that answers requests about something."""
    from rbxcompose.sdk.registry import component_type

    def answers(type_: str) -> bool:
        return any(request.about == about for request in component_type(type_).requests().types.values())

    return list(
        dict.fromkeys(robot.hosts[instance.name] for instance in robot.plan.instances if answers(instance.type))
    )


def _reachable(remotes: dict[str, Remote], robot: str) -> str:
    """Return a host that reaches the bus of a robot: this machine, else the first one that ssh reaches."""
    problems: list[str] = []
    for host, remote in sorted(remotes.items(), key=lambda item: not item[1].is_here):
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
    raise NotDoneError(UNREACHED.at(None, "; ".join(problems)))


def _run_there(remote: Remote, words: Sequence[str]) -> int:
    """Run a command on a host with the terminal of this one; an interrupt is for the command."""

    def leave(number: int, frame: FrameType | None) -> None:
        """Leave it to the command, which gets it, too."""

    has_terminal = sys.stdin.isatty() and sys.stdout.isatty()
    with handling(leave, [signal.SIGINT]):
        code = subprocess.run(remote.rbxcompose(words, has_terminal=has_terminal), check=False).returncode
    if code == SSH_FAILED and not remote.is_here:
        return refuse(UNREACHED.at(None, f"'{remote.name}' cannot be reached: see the message of ssh"))
    return code if code >= 0 else 128 - code


def _for_there(words: Sequence[str]) -> Iterator[str]:
    """Yield words without the options that are for the system."""
    rest = iter(words)
    for word in rest:
        if word in _OF_SYSTEM:
            next(rest, None)
        elif not word.startswith(tuple(f"{text}=" for text in _OF_SYSTEM)):
            yield word
