"""Our side of the bridge: a session on the robot's bus, and the process in ROS's own Python."""

from __future__ import annotations

import json
import os
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

from rbxcompose.base.requests import OutsideError
from rbxcompose.bus.names import Attachment, data_key, dds_type
from rbxcompose.bus.tokens import NodeToken, gid
from rbxcompose.bus.transport import LONGEST_WAIT, Arrival, Closable, Question, RemotePublisher, TransportReply
from rbxcompose.bus.wire import SERVICE_QOS, WireProfile, ros_qos
from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.guest import Guest
from rbxcompose.commands.lookup import BusPlace
from rbxcompose.domains.programs.bridge import link
from rbxcompose.domains.programs.bridge.ends import TOKENS, ProgramEnd
from rbxcompose.domains.programs.child import Child, StartOrder
from rbxcompose.domains.programs.sections.ros2 import RosInstallation
from rbxcompose.msgs.cdr import CdrError, decode, encode
from rbxcompose.runtime.processes import describe_exit
from rbxcompose.sdk.component import BusAddress
from rbxcompose.sdk.ports import Qos

ROS_SIDE = Path(__file__).with_name("ros_side.py")
STARTS_WITHIN = 20.0  # [s] until ROS is there
_MADE_WITHIN = 5.0  # [s] until ROS has what is to pass
_LAST_WORDS = 1.0  # [s] for its process to end, which says more than a closed socket
_DEEPEST = 1000  # messages that wait at ROS's side
_ANSWER_WITHIN = 30.0  # [s] for a service; results of goals take as long as they take


class _Lane:
    """One end on our bus."""

    def __init__(self, channel: int, end: ProgramEnd, key: str, own_gid: bytes) -> None:
        self.channel, self.end, self.key, self.gid = channel, end, key, own_gid
        self.sequence = count(1)
        self.publisher: RemotePublisher | None = None
        self.declared: list[Closable] = []

    def origin(self) -> bytes:
        return Attachment(next(self.sequence), time.time_ns(), self.gid).encode()


class RosBridge:
    """Carries bytes between a robot and ROS 2; several components may share it."""

    def __init__(self, installation: RosInstallation, address: BusAddress) -> None:
        """Start ROS's side, and wait until it is there.

        Raises:
            OutsideError: if it does not start.
        """
        self._address, self._wire = address, WireProfile(address.wire)
        self._lock = threading.Lock()
        self._lanes: dict[int, _Lane] = {}
        self._channels = count(1)
        self._questions: dict[int, Question] = {}
        self._numbers = count(1)
        self._problems: dict[int, deque[str]] = {}
        self._done: set[int] = set()
        self._heard: deque[str] = deque(maxlen=100)
        self.middleware = self.end = ""
        self._silent_since: float | None = None  # [s] since when nothing can come any more
        try:
            self._guest = Guest(BusPlace(address.router, address.domain), stays=True)
        except NotDoneError as error:
            raise OutsideError(f"the bridge does not reach the robot's bus: {error}") from error
        ours, theirs = socket.socketpair()
        for one in (ours, theirs):
            for option in (socket.SO_SNDBUF, socket.SO_RCVBUF):
                one.setsockopt(socket.SOL_SOCKET, option, 4 << 20)
        with theirs:
            command = (installation.python, str(ROS_SIDE), str(theirs.fileno()), f"_rbxcompose_{address.robot}")
            self._child = Child(
                StartOrder(command, os.getcwd(), installation.environment, 15, 1.0, descriptors=(theirs.fileno(),))
            )
        self._link = link.Link(ours)
        threading.Thread(target=self._receive, name="bridge", daemon=True).start()
        if not self._until(lambda: bool(self.middleware), STARTS_WITHIN):
            said = " | ".join(self._heard) or f"nothing after {STARTS_WITHIN:g} s"
            self.close()
            raise OutsideError(f"ROS 2 does not start ({installation.python}): {self.end or said}")

    def add(self, component: str, ends: Iterable[ProgramEnd]) -> list[int]:
        """Let ends pass, in the name of a component; return their channels once ROS has them."""
        added: list[int] = []
        orders: list[dict[str, object]] = []
        with self._lock:
            for end in ends:
                channel = next(self._channels)
                self._problems[channel] = deque(maxlen=20)
                self._lanes[channel] = self._open(channel, component, end)
                added.append(channel)
                orders.append(_order(channel, end))
        self._link.event(add=orders)
        if not self._until(lambda: {*added} <= self._done, _MADE_WITHIN):
            for channel in added:
                self._problems[channel].append(f"ROS 2 has not made it within {_MADE_WITHIN:g} s")
        return added

    def remove(self, channels: Iterable[int]) -> None:
        """End the passing of some."""
        gone = [*channels]
        self._link.event(remove=gone)
        with self._lock:
            for channel in gone:
                del self._problems[channel]
                for declared in self._lanes.pop(channel).declared:
                    declared.close()

    def problems(self, channels: Iterable[int]) -> Iterator[str]:
        """Yield what did not work since the last look, for these channels."""
        for channel in channels:
            waiting = self._problems.get(channel)
            while waiting:
                yield waiting.popleft()

    def hear(self) -> str:
        """Take what its process wrote; return how it ended, empty while it runs."""
        with self._lock:
            for event in self._child.events():
                match event:
                    case "line", text:
                        self._heard.append(text)
                    case "ended", status:
                        last = f": {self._heard[-1]}" if self._heard else ""
                        self.end = f"the process in ROS's Python {describe_exit(status)}{last}"
            since = self._silent_since
            if not self.end and since is not None and time.monotonic() - since > _LAST_WORDS:
                self.end = "the process in ROS's Python has closed the bridge"
        return self.end

    def close(self) -> None:
        """Leave the bus, and end ROS's side."""
        self._link.close()
        self._child.close()
        self._guest.__exit__(None, None, None)

    def _until(self, holds: Any, seconds: float) -> bool:
        deadline = time.monotonic() + seconds
        while not holds():
            if self.hear() or time.monotonic() > deadline:
                return False
            select.select([], [], [], 0.01)
        return True

    # The bus

    def _open(self, channel: int, component: str, end: ProgramEnd) -> _Lane:
        transport, domain, address = self._guest.transport, self._address.domain, self._address
        type_hash = self._wire.hash_of(end.interface)
        key = data_key(domain, end.name, end.interface.TYPE, type_hash)
        space = f"/{address.namespace.strip('/')}" if address.namespace else ""
        node = NodeToken(domain, transport.session, 0, component, space)
        qos = ros_qos(end.qos) if end.is_topic else SERVICE_QOS
        words = self._wire.qos_text(qos)
        token = node.endpoint_key(TOKENS[end.kind], channel, end.name, dds_type(end.interface.TYPE), type_hash, words)
        lane = _Lane(channel, end, key, gid(token))
        if end.kind == "publishes":
            lane.publisher = transport.publisher(key, end.qos)
            lane.declared.append(lane.publisher)
        elif end.kind == "subscribes":
            lane.declared.append(transport.subscribe(key, end.qos, partial(self._arrived, lane)))
        elif end.kind == "serves":
            lane.declared.append(transport.serve(key, partial(self._asked, lane)))
        lane.declared += [transport.announce(token)]
        return lane

    def _arrived(self, lane: _Lane, arrival: Arrival) -> None:
        self._link.send(lane.channel, link.DATA, arrival.payload, depth=lane.end.qos.depth)

    def _asked(self, lane: _Lane, question: Question) -> None:
        number = next(self._numbers)
        self._questions[number] = question
        self._link.send(lane.channel, link.REQUEST, question.payload, number)

    def _answered(self, channel: int, number: int, reply: TransportReply) -> None:
        kind, payload = (link.ERROR, reply.error.encode()) if reply.error else (link.RESPONSE, reply.payload)
        self._link.send(channel, kind, payload, number)

    # The socket

    def _receive(self) -> None:
        for frame in self._link.frames():
            if frame.kind == link.EVENT:
                self._take_event(json.loads(frame.payload))
            elif (lane := self._lanes.get(frame.channel)) is not None:
                try:
                    self._take(lane, frame)
                except CdrError as error:  # ROS has another definition of a service
                    self._refuse(lane, frame, str(error))
        self._silent_since = time.monotonic()

    def _refuse(self, lane: _Lane, frame: link.Frame, why: str) -> None:
        """Answer a request or a response that cannot be read."""
        if (waiting := self._problems.get(lane.channel)) is not None:
            waiting.append(why)
        if frame.kind == link.REQUEST:
            self._link.send(lane.channel, link.ERROR, why.encode(), frame.number)
        elif (question := self._questions.pop(frame.number, None)) is not None:
            question.fail(why)

    def _take(self, lane: _Lane, frame: link.Frame) -> None:
        if frame.kind == link.DATA:
            if lane.publisher is not None:
                lane.publisher.put(frame.payload, lane.origin())
        elif frame.kind == link.REQUEST:
            within = LONGEST_WAIT if lane.end.name.endswith("/_action/get_result") else _ANSWER_WITHIN
            answered = partial(self._answered, lane.channel, frame.number)
            payload = _exact(lane.end.interface.Request, frame.payload)
            self._guest.transport.ask(lane.key, payload, lane.origin(), answered, of_all=False, within=within)
        elif (question := self._questions.get(frame.number)) is not None:
            if frame.kind == link.RESPONSE:
                question.reply(_exact(lane.end.interface.Response, frame.payload), question.attachment)
            else:
                question.fail(frame.payload.decode())
            del self._questions[frame.number]

    def _take_event(self, event: Mapping[str, Any]) -> None:
        match event:
            case {"ready": str(middleware)}:
                self.middleware = middleware
            case {"done": list(channels)}:
                self._done |= {*channels}
            case {"problem": str(text), "channel": int(channel)}:
                if (waiting := self._problems.get(channel)) is not None:
                    waiting.append(text)


def _order(channel: int, end: ProgramEnd) -> dict[str, object]:
    """Return what the other side needs to know of an end: a service of ROS is asked `to_ros`."""
    return {
        "channel": channel,
        "name": end.name,
        "kind": "topic" if end.is_topic else "service",
        "way": "from_ros" if end.kind in ("publishes", "calls") else "to_ros",
        "type": end.interface.TYPE,
        "hash": end.interface.HASH,
        "depth": min(end.qos.depth, _DEEPEST),
        "latched": end.qos is Qos.LATCHED,
    }


def _exact(message: Any, payload: bytes) -> bytes:
    """Return a message as we encode it: rclpy's `serialize_message` returns more bytes than it has used."""
    return encode(decode(message, payload))


_bridges: dict[tuple[str, str, str], tuple[RosBridge, set[str]]] = {}
_sharing = threading.Lock()


def joined(installation: RosInstallation, address: BusAddress, component: str) -> RosBridge:
    """Return the bridge of this process to a ROS 2; the first component starts it.

    Raises:
        OutsideError: if it does not start.
    """
    key = installation.python, str(installation.domain), installation.environment.get("AMENT_PREFIX_PATH", "")
    with _sharing:
        bridge, users = _bridges.get(key, (None, set[str]()))
        if bridge is None or bridge.hear():
            if bridge is not None:
                bridge.close()
            bridge, users = RosBridge(installation, address), set()
        users.add(component)
        _bridges[key] = bridge, users
        return bridge


def left(bridge: RosBridge, component: str) -> None:
    """Leave a bridge; the last component ends it."""
    with _sharing:
        for key, (other, users) in list(_bridges.items()):
            if other is bridge:
                users.discard(component)
                if not users:
                    del _bridges[key]
                    bridge.close()
