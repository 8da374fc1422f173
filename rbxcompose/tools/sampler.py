"""Samples a running robot repeatedly: its state file, its processes, its log, and its bus."""

from __future__ import annotations

import json
from collections import Counter, deque
from collections.abc import Mapping
from functools import partial
from typing import Any

from rbxcompose.base.levels import Level, level_of
from rbxcompose.base.units import UNITS
from rbxcompose.bus.graph import Graph, GraphEnd, GraphName
from rbxcompose.bus.local import Inbox
from rbxcompose.bus.names import admin_key
from rbxcompose.bus.transport import TransportReply
from rbxcompose.bus.window import SCHEMA
from rbxcompose.commands.guest import LONGEST_QUEUE, Guest, ReceivedMessage
from rbxcompose.commands.guest import NAME as VISITOR
from rbxcompose.commands.lookup import known_state
from rbxcompose.missions.program.outcomes import IDLE, NAMES
from rbxcompose.missions.view.picture import picture_from_data
from rbxcompose.missions.view.replica import ACTIVE, Replica, status_list
from rbxcompose.msgs import registry
from rbxcompose.msgs.cdr import CdrError, decode
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus
from rbxcompose.runtime.folder import ComponentState, Gauge, RobotFolder, RobotState
from rbxcompose.runtime.log import NAME, Follower, Record
from rbxcompose.runtime.processes import Process
from rbxcompose.sdk.ports import Qos
from rbxcompose.tools.inspection.mission_text import running_lines
from rbxcompose.tools.robot_picture import MOST_WARNINGS, ComponentPicture, Load, RobotPicture, Tree

_HEALTH = "/diagnostics_agg"
_SUPERVISOR = "supervisor"
_WIDEST = 200  # columns per line of a mission


class Sampler:
    """Makes pictures of a robot; rates and shares are those since the previous picture.

    It counts messages by their senders. It subscribes only to topics that are neither latched nor best effort: those
    of the class `bulk` may be large, and an observer must cost little.
    """

    def __init__(self, folder: RobotFolder, guest: Guest) -> None:
        self._folder, self._guest = folder, guest
        self._follower = Follower(folder.path / NAME)
        self._warnings: deque[Record] = deque(maxlen=MOST_WARNINGS)
        self._statuses: Mapping[str, DiagnosticStatus] = {}
        self._gauges: Mapping[str, Gauge] = {}  # by topic
        self._charges: dict[str, float] = {}  # ratios, by topic
        self._listened: set[str] = set()
        self._counts: Counter[bytes] = Counter()
        self._times: dict[Process, float] = {}
        self._then: float | None = None
        self._missions: MissionsSeen | None = None

    def close(self) -> None:
        """Close the log."""
        self._follower.close()

    @property
    def is_complete(self) -> bool:
        """Return whether diagnostics, batteries and missions have been received, if there are any."""
        is_healthy = _HEALTH not in self._listened or bool(self._statuses)
        is_charged = self._charges.keys() >= self._gauges.keys() & self._listened
        return is_healthy and is_charged and (self._missions is None or self._missions.is_complete)

    def sample(self) -> RobotPicture | None:
        """Return the current picture, or None if the robot is down."""
        now, state = self._guest.clock.now(), known_state(self._folder)
        if state is None:
            return None
        elapsed = None if self._then is None else now - self._then
        self._then = now
        graph = self._guest.graph()
        self._gauges = {battery.topic: battery for battery in state.batteries.values()}
        self._listen(graph)
        self._warnings.extend(record for record in self._follower.read() if record.level is not Level.OK)
        return self._picture(state, self._rates(graph, elapsed), self._loads(state, elapsed))

    def _listen(self, graph: Graph) -> None:
        for topic in graph.topics:
            is_wanted = topic.name == _HEALTH or topic.name in self._gauges or _is_light(topic)
            if topic.name not in self._listened and topic.givers and is_wanted:
                self._listened.add(topic.name)
                self._guest.listen(topic, partial(self._receive, topic.name))

    def _trees(self, state: RobotState) -> list[Tree]:
        """Follow the missions, if the robot has any, and return the running ones while their process lives."""
        alive = state.alive()
        if not any(component.name == state.executive and component.process in alive for component in state.components):
            return []
        if self._missions is None:
            self._missions = MissionsSeen(self._guest, state.robot)
        self._missions.look()
        active = {name: seen for name, seen in self._missions.by_name.items() if seen["state"] in ACTIVE}
        return [_tree(name, seen) for name, seen in sorted(active.items())]

    def _receive(self, topic: str, received: ReceivedMessage) -> None:
        self._counts[received.sender] += 1
        if topic == _HEALTH:
            self._keep_statuses(received)
        elif gauge := self._gauges.get(topic):
            charge = _charge(gauge, received)
            self._charges |= {} if charge is None else {topic: charge}

    def _keep_statuses(self, received: ReceivedMessage) -> None:
        if received.kind.type != DiagnosticArray.TYPE:
            return
        try:
            array = decode(DiagnosticArray, received.arrival.payload)
        except CdrError:
            return  # the next one comes within a second
        self._statuses = {status.name: status for status in array.status}

    def _rates(self, graph: Graph, elapsed: float | None) -> dict[str, float]:
        """Return the message rate of each component [1/s], without those that publish nothing that is counted."""
        if elapsed is None:
            return {}
        rates: dict[str, float] = {}
        for end in (end for topic in graph.topics if topic.name in self._listened for end in topic.givers):
            name = _component(end)
            rates[name] = rates.get(name, 0.0) + self._counts[end.gid] / elapsed
        self._counts.clear()
        return rates

    def _loads(self, state: RobotState, elapsed: float | None) -> list[Load]:
        loads, times = [], {}
        for name, process in {_SUPERVISOR: state.supervisor, **state.processes}.items():
            usage = process.usage
            if usage is not None:
                times[process], memory = usage
                before = self._times.get(process)
                cpu = None if elapsed is None or before is None else (times[process] - before) / elapsed
                loads.append(Load(name, process.pid, cpu, memory))
        self._times = times
        return loads

    def _picture(self, state: RobotState, rates: Mapping[str, float], loads: list[Load]) -> RobotPicture:
        leaves = {name.rpartition("/")[2]: status for name, status in self._statuses.items() if name.count("/") > 1}
        alive = state.alive()
        components = [
            _picture_of(component, component.process in alive, rates, leaves.get(component.name))
            for component in state.components
        ]
        missions = [
            component.message for component in components if component.name == state.executive and component.message
        ]
        batteries = [
            (name, f"{100 * self._charges[battery.topic]:.1f} %")
            for name, battery in state.batteries.items()
            if battery.topic in self._charges
        ]
        groups = [status for status in self._statuses.values() if status.name.count("/") == 1]
        return RobotPicture(
            robot=state.robot,
            is_supervised=state.is_supervised,
            router=state.router if "router" in alive or "router" not in state.processes else None,
            mission=missions[0] if missions else "",
            batteries=batteries,
            components=components,
            loads=loads,
            health=[(group.name.lstrip("/"), level_of(group.level), group.message) for group in groups],
            warnings=list(self._warnings),
            trees=self._trees(state),
        )


def _is_light(topic: GraphName) -> bool:
    return all(end.qos is not None and end.qos.is_reliable and not end.qos.is_transient_local for end in topic.givers)


def _component(end: GraphEnd) -> str:
    return end.node.rpartition("/")[2]


def _charge(gauge: Gauge, received: ReceivedMessage) -> float | None:
    """Return the charge that a message reports (a ratio); None if it reports none."""
    try:
        message = decode(registry.message(received.kind.type), received.arrival.payload)
    except (CdrError, KeyError):  # broken, or of a package that is not installed
        return None
    values = [getattr(message, name) for name in message.FIELDS]
    if received.kind.type != gauge.message or len(values) != 1 or not isinstance(values[0], int | float):
        return None
    unit = UNITS.get(gauge.unit)
    return unit.to_si(values[0]) if unit else float(values[0])


def _tree(name: str, seen: Mapping[str, Any]) -> Tree:
    picture = picture_from_data(seen["picture"])
    return Tree(name, seen["state"], running_lines(picture, status_list(seen, picture.count), _WIDEST))


def _picture_of(
    component_state: ComponentState, is_alive: bool, rates: Mapping[str, float], status: DiagnosticStatus | None
) -> ComponentPicture:
    return ComponentPicture(
        component_state.name,
        component_state.type,
        component_state.state if is_alive else "dead",
        component_state.process,
        component_state.restarts,
        rates.get(component_state.name) if is_alive else None,
        None if status is None else level_of(status.level),
        "" if status is None else status.message,
    )


_PATH = "missions"


class MissionsSeen:
    """Follows all missions of a robot; `by_name` has the state of those that have been running."""

    def __init__(self, guest: Guest, robot: str) -> None:
        self._guest, self._robot = guest, robot
        self._replicas: dict[str, Replica] = {}
        self._asked: set[str] = set()  # paths with a pending answer
        self._is_listed = False
        news: Inbox[bytes] = Inbox(VISITOR, LONGEST_QUEUE, self._receive, guest.scheduler.post)
        transport = guest.transport
        pattern = f"{admin_key(robot, _PATH)}/*"
        transport.subscribe(pattern, Qos.STATE, lambda arrival: news.put(arrival.payload, transport.wake))
        self.look()

    @property
    def by_name(self) -> Mapping[str, Mapping[str, Any]]:
        """Return the known state of each mission, with its picture."""
        return {name: replica.seen for name, replica in self._replicas.items() if replica.seen}

    @property
    def is_complete(self) -> bool:
        """Return whether all answers have arrived."""
        return self._is_listed and not self._asked

    def look(self) -> None:
        """Query the list of missions, unless it is known; a robot that has just started may not answer yet."""
        if not self._is_listed:
            self._ask(_PATH)

    def _ask(self, path: str) -> None:
        if path in self._asked:
            return
        self._asked.add(path)
        transport, answers = self._guest.transport, _Answers(self, path)
        inbox: Inbox[TransportReply] = Inbox(VISITOR, None, answers.take, self._guest.scheduler.post)
        transport.ask(admin_key(self._robot, path), b"", b"", lambda answer: inbox.put(answer, transport.wake))

    def answered(self, path: str, answer: TransportReply) -> None:
        """Apply the first answer to a query."""
        self._asked.discard(path)
        if answer.error:
            return
        if (message := _read(answer.payload)) is None:
            return
        if path == _PATH:
            self._is_listed = True
            for entry in message["value"]:
                if entry["state"] != NAMES[IDLE]:
                    self._ask(f"{_PATH}/{entry['name']}")
            return
        name = message["value"]["mission"]
        if self._replicas.setdefault(name, Replica()).answered(message):
            self._ask(path)

    def _receive(self, payload: bytes) -> None:
        if (message := _read(payload)) is None:
            return
        name = message["value"]["mission"]
        if self._replicas.setdefault(name, Replica()).apply(message):
            self._ask(f"{_PATH}/{name}")


def _read(payload: bytes) -> dict[str, Any] | None:
    """Return a message, or None if the robot runs another version with another format."""
    message: dict[str, Any] = json.loads(payload)
    return message if message.get("schema") == SCHEMA else None


class _Answers:
    """The answers to one query: it ends with an error even after an answer, so only the first counts."""

    def __init__(self, asking: MissionsSeen, path: str) -> None:
        self._asking, self._path = asking, path
        self._is_over = False

    def take(self, answer: TransportReply) -> None:
        if not self._is_over:
            self._is_over = True
            self._asking.answered(self._path, answer)
