"""A program of others: started, watched and stopped as a component, its ports as the manifest declares them."""

from __future__ import annotations

import json
import math
import os
import re
import shlex
import signal
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from string import ascii_letters, digits
from typing import Annotated, Any, Literal, TypeVar
from uuid import uuid4
from zlib import crc32

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from rbxcompose.base.clock import MonotonicClock, SteppedClock
from rbxcompose.base.config import Config, LocalFiles, LocalPath, Secret, Time, bundle_path
from rbxcompose.base.files import replace_file
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import OutsideError
from rbxcompose.bus.names import ActionNames, dds_type
from rbxcompose.bus.tokens import SPACE, EndpointToken, NodeToken, parse_token
from rbxcompose.bus.transport import Closable
from rbxcompose.bus.wire import WireProfile, ros_qos
from rbxcompose.bus.zenoh_session import SessionLink, as_file, guest_settings
from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.guest import Guest
from rbxcompose.commands.lookup import BusPlace
from rbxcompose.domains.programs.bridge.ends import TOKENS, ends_of
from rbxcompose.domains.programs.child import Child, Event, OutputLog, StartOrder
from rbxcompose.domains.programs.declaration import DeclaredPorts, port_name, published
from rbxcompose.domains.programs.watch import DeclaredKey, EndKind, KeyOnBus, ProgramWatch
from rbxcompose.msgs.action_msgs import CancelGoal
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.processes import Process, describe_exit
from rbxcompose.sdk import Capability, Component, ComponentNoted, component
from rbxcompose.sdk.capabilities import RunsProgram, Setting
from rbxcompose.sdk.ports import CallsAction, In, Out, Port, Qos, ServesAction
from rbxcompose.sdk.updater import FrequencyTask, TaskStatus

LOOKS = 1.0  # [s] between two looks at what its session declares, and at its memory
_ANSWERS = 0.3  # [s] for its session to answer with whom it is linked
_STARTS = 10.0  # [s] for a program to run that has nothing else to wait for
_LISTENS, _AGAIN = 10.0, 60.0  # [s] for which all that it publishes is heard at first, and between two looks later
_LINKS = 2.0  # [s] for it to be linked with the robot's processes
_STRANGER = 0.5  # [s] after which it does not seem to use the configuration that it was given
_PAUSE = 0.05  # [s] between two looks at a program that is not ready yet
_OF_TOKENS = {token: kind for kind, token in TOKENS.items()}
_ACTIONS = ServesAction, CallsAction
_MEGABYTE = 1_000_000


def _words(value: Any) -> Any:
    if isinstance(value, str):
        help_text = f"no shell reads it; write its words: [{', '.join(map(_quoted, _split(value)))}]"
        if _SHELL & set(value):
            help_text = f"only a shell reads that: [sh, -c, {json.dumps(value)}]"
        raise PydanticCustomError("command", "a command is a list of words", {"help": help_text})
    if isinstance(value, Sequence) and value and value[0] == "":
        raise PydanticCustomError("command", "a command begins with an executable", {"help": "such as [./program]"})
    return value


_SHELL, _PLAIN = set("|&;<>$`"), set(f"{ascii_letters}{digits}_./=+-")


def _split(text: str) -> list[str]:
    try:
        return shlex.split(text)
    except ValueError:  # a quote without its end
        return text.split()


def _quoted(word: str) -> str:
    return word if set(word) <= _PLAIN and not word.replace(".", "").isdigit() and word else json.dumps(word)


def _is_pattern(text: str) -> str:
    try:
        re.compile(text)
    except re.error as error:
        raise ValueError(f"is not a regular expression: {error}") from error
    return text


Pattern = Annotated[str, Field(min_length=1, max_length=500), AfterValidator(_is_pattern)]


def _is_variable(name: str) -> str:
    if not name or set("=\0") & set(name):
        raise PydanticCustomError(
            "variable", "no name", {"help": "a variable's name has one character or more, and no '='"}
        )
    if name == "ROS_DOMAIN_ID" or name.startswith("RBXCOMPOSE_"):
        raise PydanticCustomError(
            "variable", "no name", {"help": "the robot sets it: remove it; the domain of all is 'bus: {domain: 7}'"}
        )
    return name


VariableName = Annotated[str, AfterValidator(_is_variable)]
CommandWords = Annotated[
    tuple[str, ...], BeforeValidator(_words, json_schema_input_type=tuple[str, ...]), Field(min_length=1)
]


def _is_there(path: str) -> str:
    if not os.path.exists(path):
        raise ValueError(f"there is no '{path}'")
    return path


def bundle_command(command: Iterable[str] | None, folder: str, info: ValidationInfo) -> str:
    """Let the files that a command names travel with the manifest; return the folder where it runs."""
    for file in (os.path.join(folder, word) for word in command or ()):
        if os.path.isfile(file):
            bundle_path(file, info)
    return folder


class ReadyModel(Config):
    """When a program is ready; components that start after it wait for that."""

    topic: str = ""
    """When the first message of this topic has come, one of those that it publishes."""
    output: Pattern | None = None
    """When it writes a line in which this regular expression is found."""
    token: str = ""
    """When there is a liveliness token of Zenoh that this key expression matches."""
    ended: bool = False
    """When it has ended with the exit code 0: it prepares something, and does not run on."""
    within: Time = Field(10.0, gt=0, le=600)
    """Otherwise it has failed."""

    @model_validator(mode="after")
    def _is_one(self) -> ReadyModel:
        if sum(map(bool, (self.topic, self.output, self.token, self.ended))) != 1:
            raise ValueError("needs one of 'topic', 'output', 'token' and 'ended'")
        return self


class StopModel(Config):
    """How a program is stopped."""

    signal: Literal["SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGUSR1", "SIGUSR2"] = "SIGTERM"
    """The signal that it gets, with all that it started."""
    within: Time = Field(3.0, gt=0, le=30)
    """How long it may take; then it is killed."""


class ProgramLimits(Config):
    """What a program may use."""

    memory: float | None = Field(None, gt=0)
    """Resident memory of all its processes in MB; with more it is stopped, and has failed."""
    open_files: int | None = Field(None, ge=8)
    """Open files."""
    nice: int = Field(0, ge=-20, le=19)
    """Added to its niceness; more is lower priority."""
    cores: tuple[Annotated[int, Field(ge=0)], ...] = ()
    """The processors that it may use; empty for all."""


class LevelsModel(Config):
    """How lines of its output are known to be warnings and errors; without, by the words that loggers write."""

    warn: Pattern | None = None
    """A warning has this."""
    error: Pattern | None = None
    """An error has this."""


class RunConfig(DeclaredPorts):
    """How a program is run, whatever kind it is of."""

    environment: dict[VariableName, str] = {}
    """Variables of its environment, besides those of `up`."""
    secrets: dict[VariableName, Secret] = {}
    """The same for what nobody else may see, such as `{TOKEN: "${secret.token}"}`."""
    ready: ReadyModel | None = None
    """When it is ready; without it, as soon as it runs."""
    stop: StopModel = StopModel()
    """How it is stopped."""
    limits: ProgramLimits = ProgramLimits()
    """What it may use."""
    files: tuple[Annotated[LocalFiles, AfterValidator(_is_there)], ...] = ()
    """Files and folders of the project that it needs beside the files that its command names; they travel to other
    hosts with the manifest."""
    levels: LevelsModel = LevelsModel()
    """How its output is read."""

    @field_validator("ready")
    @classmethod
    def _waits_for_its_own(cls, given: ReadyModel | None, info: ValidationInfo) -> ReadyModel | None:
        if given is not None and "publishes" in info.data:
            published(given.topic, info.data["publishes"])
        return given


R = TypeVar("R", bound=RunConfig)


class Runner(Component[R]):
    """Runs a program of others: what all types that do so have in common."""

    blocking = True  # a program may take its time to get ready
    configures_within = 620.0
    process = "programs"
    has_parameters = False  # the program may have some under the same name
    rate = 10.0

    @classmethod
    def ports(cls, config: R) -> dict[str, Port[Any]]:
        """Return the ports that the manifest declares; the program has their ends."""
        return config.ports()

    @classmethod
    def capabilities(cls, config: R) -> tuple[Capability, ...]:
        """Return what the manifest says that it can do."""
        return tuple(config.declared_capabilities())

    @classmethod
    def rest_time(cls, config: R) -> float:
        """Return how long it may take to end."""
        drives = config.capabilities.drives
        coasting = (drives.stops_after or 0.0) if drives is not None else 0.0
        return coasting + config.stop.within + 1.0

    def order(self, environment: Mapping[str, str]) -> StartOrder | None:
        """Return what to start, with these variables beside its own; None if something else starts it."""
        raise NotImplementedError

    def connect(self) -> None:
        """Make what it needs on the bus besides its own session, before it starts."""

    def attend(self) -> None:
        """Look after that, at each step."""

    def disconnect(self) -> None:
        """Take that away."""

    @property
    def joins_bus(self) -> bool:
        """Return whether it speaks Zenoh itself."""
        return True

    @property
    def most_memory(self) -> float | None:
        """Return what its processes may hold in memory [MB]."""
        return self.config.limits.memory

    def described(self, status: int) -> str:
        """Return in words how it has ended."""
        return describe_exit(status)

    # Lifecycle

    def configure(self) -> None:
        """Prepare to hear it; on a stepped clock nothing runs, since no program keeps up with that."""
        self.child: Child | None = None
        self.guest: Guest | None = None
        self.is_over = True
        self.is_ending = False
        self.ends_at: float | None = None
        self.looked = -LOOKS
        self.link: SessionLink | None = None
        self.linked = 0.0
        self.suspended = ""  # in words, if it is
        self.tokens: dict[str, Closable] = {}
        self.heard: dict[str, Closable] = {}
        self.session = self.endpoint = ""
        self.joining: dict[str, str] = {}
        levels = {Level.ERROR: self.config.levels.error, Level.WARN: self.config.levels.warn}
        self.output = OutputLog({level: text for level, text in levels.items() if text})
        ready = self.config.ready
        self.marks_ready = re.compile(ready.output) if ready is not None and ready.output is not None else None
        self.is_inert = type(self.context.clock) is SteppedClock
        self.real_time = MonotonicClock()  # that of processes, also where robot time is that of a simulator
        self.ends = {} if self.is_inert else {end.port: end for end in self._declared()}
        actions = {str(self.bound[name]) for name, port in self._elsewhere() if isinstance(port, _ACTIONS)}
        self.watched = ProgramWatch(self.ends.values(), actions, self.now)
        for end in self.ends.values():
            if end.rate is not None:
                self.add_diagnostic(end.key.name.lstrip("/"), self._frequency(end))
        self.add_diagnostic("program", lambda now: self.state)
        self.state = TaskStatus(Level.OK, "not started yet")
        self.at_end.callback(self._release)

    def activate(self) -> None:
        """Start it, and wait until it is ready."""
        if self.is_inert:
            self.warn("does not run: robot time is stepped, and programs of others keep real time")
            return
        with self._leaving_nothing():
            self._start()

    def _start(self) -> None:
        address = self.context.address
        try:
            self.guest = guest = Guest(BusPlace(address.router, address.domain), stays=True)
        except NotDoneError as error:
            raise OutsideError(f"cannot be started: {error}") from error
        self.joining = self._joining()
        self.is_over = False
        order = self.order({**os.environ, **self.joining})
        if self.joins_bus and order is not None:
            subscribed, served = self._keys_of("subscribes"), self._keys_of("serves")
            self.link = SessionLink(self.endpoint, self.session, subscribed, served)
            self.linked = self.real_time.now()
        self.connect()
        if order is not None:
            self.child = Child(order)
        self._listen(guest)
        self._wait_until_ready(guest)
        self.watched.began(self.now)

    def step(self, dt: float) -> None:
        """Hear what it writes, whether it still runs, and compare what it does with what it declares."""
        if self.guest is None:
            return
        with self._leaving_nothing():
            self.attend()
            self._hear()
            if self.child is None:
                return
            if self.ends_at is not None and self.real_time.now() >= self.ends_at:
                self.child.ask_to_end()
            if self.is_over or self.real_time.now() - self.looked < LOOKS:
                return
            self.looked = self.real_time.now()
            self._mind_memory(self.child)
            if self.joins_bus and self.guest is not None:
                self._compare(self.guest)
            self._tell_suspension(is_suspended=is_suspended(self.child.pid))

    @contextmanager
    def _leaving_nothing(self) -> Iterator[None]:
        try:
            yield
        except BaseException:
            self._release()
            raise

    def stop(self) -> None:
        """Cancel the goals of actions that claim a part of the robot."""
        self._cancel_goals()

    def brake(self) -> None:
        """End it; a base first gets the time in which it brakes by itself."""
        self._cancel_goals()
        drives = self.config.capabilities.drives
        self.is_ending, now = True, self.real_time.now()
        self.ends_at = now + ((drives.stops_after or 0.0) if drives else 0.0)
        if self.child is not None and self.ends_at <= now:
            self.child.ask_to_end()

    @property
    def is_at_rest(self) -> bool:
        """Return whether it has ended, once the robot goes down."""
        return self.child is None or self.is_over or not self.is_ending

    def deactivate(self) -> None:
        """End it if it still runs."""
        if self.child is not None and not self.is_over:
            self.is_ending = True
            self.child.ask_to_end()
            deadline = self.real_time.now() + self.config.stop.within + _ANSWERS
            while not self.is_over and self.real_time.now() < deadline:
                self.child.wait(_PAUSE)
                self._hear()

    # Starting

    def _joining(self) -> dict[str, str]:
        """Return the variables by which a program joins the robot."""
        address = self.context.address
        self.session = f"{uuid4().int % 15 + 1:x}{uuid4().hex[1:]}"
        settings, self.endpoint = guest_settings(address.router, self.session)
        file = RobotFolder.of(address.robot).path / f"{self.name}.zenoh.json5"
        replace_file(file, as_file(settings).encode())
        names = ((f"{name}_{part}" if part else name, key) for name, part, key in self._keys())
        keys = {f"RBXCOMPOSE_KEY_{name.upper()}": key.text(address.domain) for name, key in names}
        return {
            "ZENOH_CONFIG": str(file),
            "ZENOH_SESSION_CONFIG_URI": str(file),
            "ROS_DOMAIN_ID": str(address.domain),
            "PYTHONUNBUFFERED": "1",  # a line is written when it is printed, as to a terminal
            "RBXCOMPOSE_ROBOT": address.robot,
            "RBXCOMPOSE_COMPONENT": self.name,
            "RBXCOMPOSE_NAMESPACE": address.namespace,
            "RBXCOMPOSE_ROUTER": address.router,
            **keys,
            **self.config.environment,
            **{name: secret.reveal() for name, secret in self.config.secrets.items()},
        }

    def _keys(self) -> Iterator[tuple[str, str, KeyOnBus]]:
        """Yield the name of each port, which part of an action it is of which there are five, and the key of that."""
        wire = WireProfile(self.context.address.wire)
        for name, port in self._elsewhere():
            for end in ends_of(port, str(self.bound[name])):
                key = KeyOnBus(end.kind, end.name, dds_type(end.interface.TYPE), wire.hash_of(end.interface))
                yield name, end.part, key

    def _keys_of(self, kind: EndKind) -> list[str]:
        return [key.text(self.context.address.domain) for _, _, key in self._keys() if key.kind == kind]

    def _elsewhere(self) -> Iterator[tuple[str, Port[Any]]]:
        return ((name, port) for name, port in self.ports(self.config).items() if port.is_elsewhere)

    def _declared(self) -> Iterator[DeclaredKey]:
        ports = dict(self._elsewhere())
        for name, part, key in self._keys():
            port = ports[name]
            if not part or (isinstance(port, ServesAction) and part == "send_goal"):  # which stands for all parts
                yield DeclaredKey(name, key, port.rate if isinstance(port, Out) else None)

    def _listen(self, guest: Guest) -> None:
        """Count the messages of its topics: of those with a rate all, of the others until one has come."""
        for name, port in self._elsewhere():
            if isinstance(port, Out):
                key = self.ends[name].key.text(guest.domain)
                self.heard[name] = guest.transport.subscribe(key, port.qos, partial(self._arrived, name))

    def _arrived(self, name: str, arrival: object) -> None:
        self.watched.arrived(name)  # in a thread of Zenoh's

    def _wait_until_ready(self, guest: Guest) -> None:
        ready = self.config.ready
        within = ready.within if ready is not None else _STARTS
        deadline = self.real_time.now() + within
        self.is_ready = False
        while not self._is_ready(ready, guest):
            if self.real_time.now() >= deadline:
                raise OutsideError(f"is not ready after {within:g} s")
            if self.context.is_over:
                raise OutsideError("is not ready yet, and the robot goes down")
            if self.child is not None:
                self.child.wait(_PAUSE)
            self._hear()
        if self.joins_bus:
            self._wait_until_linked(guest)

    def _wait_until_linked(self, guest: Guest) -> None:
        """Wait until what it publishes reaches every process of the robot."""
        began = self.real_time.now()
        while not (is_linked := guest.is_linked(self.session, _ANSWERS)):
            if self.real_time.now() - began > (_STRANGER if is_linked is None else _LINKS):
                break
            guest.run(lambda: False, _PAUSE)

    def _is_ready(self, ready: ReadyModel | None, guest: Guest) -> bool:
        if ready is None or ready.output is not None or ready.ended:
            return self.is_ready or (ready is None and self.child is None)  # as its events say
        if ready.topic:
            return self.watched.count(port_name(ready.topic)) > 0
        return bool(guest.tokens(ready.token))

    # Running

    def _hear(self) -> None:
        """Log what it writes, and take note of its end."""
        if self.child is None:
            return
        lines, ready = list[str](), self.config.ready
        for event in self.child.events():
            match event:
                case "line", text:
                    lines.append(text)
                    if self.marks_ready is not None and self.marks_ready.search(text):
                        self.is_ready = True
                case "started", _:
                    self.is_ready = self.is_ready or ready is None
                    self.state = TaskStatus(Level.OK, self._running)
                case _:
                    self._log(lines)
                    lines = []
                    self._happened(event)
        self._log(lines)
        if self.child is not None and self.child.is_over and not self.is_over:
            self._ended("was killed, since its keeper was")

    def _happened(self, event: Event) -> None:
        match event:
            case "failed", why:
                self._ended(f"cannot be started: {why}")
            case "deaf", _:
                within, name = self.config.stop.within, self.config.stop.signal
                self.warn(f"did not end within {within:g} s of {name}, and was killed")
            case "left", number:
                left = "one process, which was" if number == 1 else f"{number} processes, which were"
                self.warn(f"left behind {left} killed: what it starts must end with it")
            case "ended", status if self.config.ready is not None and self.config.ready.ended and not status:
                self.is_over = self.is_ready = True
                self.state = TaskStatus(Level.OK, "has ended, as it should")
            case "ended", status:
                self._ended(self.described(status))

    def _ended(self, how: str) -> None:
        self.is_over = True
        self.state = TaskStatus(Level.ERROR, how)
        if self.is_ending:
            self.info(how)
            return
        self._hear_the_rest()
        raise OutsideError(how)

    @property
    def _running(self) -> str:
        return f"runs, pid {self.child.pid}" if self.child is not None and self.child.pid is not None else "runs"

    def _hear_the_rest(self) -> None:
        """Wait for the keeper, which ends what was left behind; what was written to the last is logged."""
        is_over = False
        while self.child is not None and not is_over:
            is_over = self.child.is_over  # before what may be the last look
            for event in self.child.events():
                if event[0] == "line":
                    self._log([event[1]])
                else:
                    self._happened(event)
            if not is_over:
                self.child.wait(_PAUSE)
        for level, text in self.output.take((), math.inf):
            self.context.log(level, text)

    def _log(self, lines: Iterable[str]) -> None:
        for level, text in self.output.take(lines, self.now):
            self.context.log(Level.OK if self.is_ending else level, text)  # its end is wanted, however loud

    def _mind_memory(self, child: Child) -> None:
        most = self.most_memory
        if most is None or self.is_ending:
            return
        if (used := child.memory / _MEGABYTE) > most:
            raise OutsideError(f"uses {used:.0f} MB, and may use {most:g}")

    def _tell_suspension(self, *, is_suspended: bool) -> None:
        """Report a program that a signal suspends, also beside its name in `ps`; once it runs again, no longer."""
        text = "is suspended by a signal" if is_suspended else ""
        if text:
            self.state = TaskStatus(Level.WARN, text)
        elif self.suspended:
            self.state = TaskStatus(Level.OK, self._running)
        if text != self.suspended:
            self.suspended = text
            self.warn(text or "is no longer suspended")
            self.context.notify(ComponentNoted(self.name, text))

    def _compare(self, guest: Guest) -> None:
        """Find what its session has, name it to the others, and report what does not fit."""
        tokens = map(parse_token, guest.tokens(f"{SPACE}/{guest.domain}/{self.session}/**"))
        own = [token for token in tokens if isinstance(token, EndpointToken) and token.key not in self.tokens]
        if own or self.link is None:
            found = {_key_of(token) for token in own}  # a node of ROS 2 says itself what it has
            self._announce(guest, set())
        else:
            found = self._seen(self.link, guest.domain)
            self._announce(guest, found)
        for name in [name for name in self.heard if self.watched.count(name) and self.ends[name].rate is None]:
            self.heard.pop(name).close()
        status = self.watched.look(found, self.now)
        for text in self.watched.news(status):
            self.warn(text)
        self.state = TaskStatus(status.level, f"{self._running}; {status.message}", status.values)

    def _seen(self, link: SessionLink, domain: int) -> set[KeyOnBus]:
        """Return what is seen of its session; nothing, if it is not the one that it was given.

        A publisher that is silent cannot be seen. If there is anything else, those that are declared count as there.
        """
        if not link.is_linked:
            return set()
        since = self.real_time.now() - self.linked
        link.listen(f"{domain}/**" if since < _LISTENS or since % _AGAIN < 2 * LOOKS else None)
        declared = {key.text(domain): key for _, _, key in self._keys()}
        found = {declared[text] for text in link.matching()}
        found |= {key for text in link.heard() if (key := KeyOnBus.of("publishes", text, domain)) is not None}
        return found | {key for key in declared.values() if found and key.kind == "publishes"}

    def _announce(self, guest: Guest, found: set[KeyOnBus]) -> None:
        """Declare tokens for its ends, so that tools and clients find them as those of ROS 2."""
        qos = {str(self.bound[name]): port.qos for name, port in self._elsewhere() if isinstance(port, Out | In)}
        address = self.context.address
        namespace = f"/{address.namespace}" if address.namespace else ""
        node, wire = NodeToken(address.domain, self.session, 0, self.name, namespace), WireProfile(address.wire)
        wanted = {node.key} if found else set[str]()
        for key in found:
            words, number = wire.qos_text(ros_qos(qos.get(key.name, Qos.EVENT))), crc32(str(key).encode())
            wanted.add(node.endpoint_key(TOKENS[key.kind], number, key.name, key.type, key.hash, words))
        for text in wanted - self.tokens.keys():
            self.tokens[text] = guest.transport.announce(text)
        for text in self.tokens.keys() - wanted:
            self.tokens.pop(text).close()

    def _cancel_goals(self) -> None:
        if self.guest is None:
            return
        for name, port in self._elsewhere():
            if isinstance(port, ServesAction) and port.claims:
                service = ActionNames.of(str(self.bound[name])).cancel_goal
                client = self.guest.bus().client(self.name, service, CancelGoal)
                client(CancelGoal.Request(), lambda reply: None)  # no goal in particular: all
                self.guest.run(lambda: False, _ANSWERS)

    def _frequency(self, end: DeclaredKey) -> Any:
        task, counted = FrequencyTask(end.rate or 0.0), 0

        def status(now: float) -> TaskStatus:
            nonlocal counted
            for _ in range(self.watched.count(end.port) - counted):
                task.tick()
            counted = self.watched.count(end.port)
            return task.status(now)

        return status

    def _release(self) -> None:
        """End what is left of it, and leave the bus."""
        self.is_over = True
        if self.suspended:
            self.context.notify(ComponentNoted(self.name, ""))
        if self.child is not None:
            self.child.close()
            self.child = None
        for closable in (*self.tokens.values(), *self.heard.values()):
            closable.close()
        self.tokens, self.heard = {}, {}
        self.disconnect()
        if self.link is not None:
            self.link.close()
            self.link = None
        if self.guest is not None:
            self.guest.__exit__(None, None, None)
            self.guest = None


def is_suspended(pid: int | None) -> bool:
    """Return whether a signal keeps this process, if there is one, from running."""
    try:
        return pid is not None and Process.of(pid).is_stopped
    except ProcessLookupError:
        return False


def _key_of(token: EndpointToken) -> KeyOnBus:
    return KeyOnBus(_OF_TOKENS[token.kind], token.name, token.dds_type, token.type_hash)


class ProgramConfig(RunConfig):
    """What is run."""

    command: CommandWords
    """Its words: an executable, found in `folder` if it begins with `./`, else by PATH, and its arguments. No shell
    reads them."""
    folder: LocalPath = Field(".", validate_default=True)
    """Where it runs, relative to the manifest's file."""

    @field_validator("folder")
    @classmethod
    def _brings_what_it_names(cls, folder: str, info: ValidationInfo) -> str:
        return bundle_command(info.data.get("command"), folder, info)


@component("program")
class ProgramRunner(Runner[ProgramConfig]):
    """Runs a program of others that speaks Zenoh, with the ports that the manifest declares for it.

    Example:
        talker: {type: program, command: [./talker, --fast], publishes: {chatter: std_msgs/String}}
    """

    @classmethod
    def capabilities(cls, config: ProgramConfig) -> tuple[Capability, ...]:
        """Return what the manifest says that it can do, and what `up` looks for."""
        environment = Setting(config.environment, "environment")
        found = RunsProgram(Setting(config.command, "command"), Setting(config.folder, "folder"), environment)
        return (*config.declared_capabilities(), found)

    def order(self, environment: Mapping[str, str]) -> StartOrder:
        """Return the command."""
        return order_of(self.config, self.config.command, self.config.folder, environment)


def order_of(config: RunConfig, command: Iterable[str], folder: str, environment: Mapping[str, str]) -> StartOrder:
    """Return what to start, with the limits of a configuration."""
    return StartOrder(
        tuple(command),
        str(Path(folder)),
        environment,
        int(signal.Signals[config.stop.signal]),
        config.stop.within,
        config.limits.open_files,
        config.limits.nice,
        config.limits.cores,
    )
