"""What `top` shows of a robot and of a whole system: sampled from state file, processes, log and bus; and its lines."""

import json
from collections import Counter, deque
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from itertools import repeat
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level, level_of
from rbxcompose.base.printable import columns, fitted, plain
from rbxcompose.base.units import UNITS
from rbxcompose.bus.graph import Graph, GraphName
from rbxcompose.bus.local import Inbox
from rbxcompose.bus.names import admin_key
from rbxcompose.bus.services import SCHEMA
from rbxcompose.bus.transport import LONGEST_WAIT, TransportReply
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

MOST_WARNINGS = 5
_GAP = "  "
_RESET = "\x1b[0m"
BOLD, FAINT, YELLOW, RED, _MAGENTA = "\x1b[1m", "\x1b[2m", "\x1b[33m", "\x1b[31m", "\x1b[35m"
ALARMS = {Level.OK.name: "", Level.WARN.name: YELLOW, Level.ERROR.name: RED, Level.STALE.name: _MAGENTA}
_FAILED = frozenset({"failed", "dead", "lost"})
_MOST_OF_NAMES = 24  # columns
SILENT = 3.0  # [s] after which a host does not answer
_HEALTH = "/diagnostics_agg"
_SUPERVISOR = "supervisor"
_WIDEST = 200  # columns per line of a mission
_PATH = "missions"


TopData = Mapping[str, Any]
"""All that is shown of a robot, as `--json` writes it, with levels by name: `processes` with their shares of one
processor and their memory [B], `diagnostics` by group, `missions` that run with their running nodes as lines from the
outside in, and of each component the rate of its outgoing messages [1/s]; None where unknown."""


@dataclass(frozen=True, slots=True)
class PictureLine:
    """A line, and the colour that it has on a terminal."""

    text: str
    colour: str = ""


def lines_of(picture: TopData, width: int, height: int, *, colour: bool = False) -> list[str]:
    """Return at most `height` lines of at most `width` columns; count what does not fit.

    Missions get the room that all else leaves; components go last.
    """
    supervisor = "" if picture["is_supervised"] else "; its supervisor is dead, 'rbxcompose down' ends what is left"
    lines = [PictureLine(f"{plain(picture['robot'])}: router {plain(picture['router'] or 'none')}{supervisor}", BOLD)]
    if picture["mission"]:
        lines.append(PictureLine(f"mission: {plain(picture['mission'])}"))
    if batteries := picture["batteries"]:
        lines.append(PictureLine(_GAP.join(f"{plain(name)}: {plain(text)}" for name, text in batteries.items())))
    head = [*lines, PictureLine("")]
    loads = [PictureLine(""), *_loads(picture["processes"])]
    tail = [*_health(picture["diagnostics"]), *_warnings(picture["warnings"])]
    room = max(2, height - len(head) - len(loads) - len(tail))
    components = shortened(_components(picture["components"]), room)
    left = height - len(head) - len(components) - len(loads) - len(tail)
    shown = [*head, *components, *loads, *_missions(picture["missions"], left), *tail][:height]
    return [painted(line, width, colour) for line in shown]


def _components(components: Sequence[TopData]) -> list[PictureLine]:
    rows = [(each["name"], each["type"], each["state"], each["process"], *_facts(each)) for each in components]
    return _table([("component", "type", "state", "process", "restarts", "msg/s", ""), *rows], map(_alarm, components))


def _facts(component: TopData) -> tuple[str, str, str]:
    """Return how often it was restarted, the rate of its messages, and what is wrong with it, in words."""
    rate = "-" if component["rate"] is None else f"{component['rate']:.1f}"
    is_fine = component["level"] in (None, Level.OK.name)
    return str(component["restarts"]), rate, "" if is_fine else f"{component['level']}: {component['message']}"


def _alarm(component: TopData) -> str:
    if component["state"] in _FAILED:
        return RED
    return YELLOW if component["state"] != "active" else ALARMS.get(component["level"], "")


def _loads(loads: Sequence[TopData]) -> list[PictureLine]:
    rows = []
    for load in loads:
        cpu = "-" if load["cpu"] is None else f"{load['cpu']:.1%}"
        rows.append((load["process"], str(load["pid"]), cpu, f"{load['memory'] / 1e6:.0f} MB"))
    return _table([("process", "pid", "cpu", "memory"), *rows], repeat(""))


def _missions(missions: Sequence[TopData], room: int) -> list[PictureLine]:
    lines = []
    for mission in missions:
        lines.append(PictureLine(f"mission {plain(mission['mission'])}: {plain(mission['state'])}", FAINT))
        lines += [PictureLine(plain(line)) for line in mission["running"]]
    return [PictureLine(""), *shortened(lines, room - 1)] if lines and room > 1 else []


def _health(groups: Sequence[TopData]) -> list[PictureLine]:
    fine = [plain(group["group"]) for group in groups if group["level"] == Level.OK.name]
    lines = [
        PictureLine(f"{group['level']} {plain(group['group'])}: {plain(group['message'])}", ALARMS[group["level"]])
        for group in groups
        if group["level"] != Level.OK.name
    ]
    lines += [PictureLine(f"OK {', '.join(fine)}")] if fine else []
    return _apart(lines)


def _warnings(warnings: Sequence[TopData]) -> list[PictureLine]:
    lines = []
    for warning in warnings[-MOST_WARNINGS:]:
        text = f"{warning['time']:8.1f}  {plain(warning['source'])}: {plain(warning['text'])}"
        lines.append(PictureLine(text, ALARMS[warning["level"]]))
    return _apart(lines)


def _apart(lines: Sequence[PictureLine]) -> list[PictureLine]:
    """Return lines below an empty one, if there are any."""
    return [PictureLine(""), *lines] if lines else []


def _table(rows: Sequence[Iterable[str]], colours: Iterable[str]) -> list[PictureLine]:
    """Return a head, and rows below it in these colours."""
    head, *lines = table_of(rows)
    return [PictureLine(head, FAINT), *map(PictureLine, lines, colours)]


def shortened(lines: Sequence[PictureLine], room: int) -> list[PictureLine]:
    """Return at most `room` lines; the last one counts those that do not fit."""
    if len(lines) <= room:
        return list(lines)
    return [*lines[: room - 1], PictureLine(f"... and {len(lines) - room + 1} more", FAINT)]


def table_of(rows: Sequence[Iterable[str]]) -> list[str]:
    """Return rows as lines whose columns stand below each other; the last cell of each may be long."""
    cells = [[fitted(plain(cell), _MOST_OF_NAMES) for cell in row[:-1]] + [plain(row[-1])] for row in map(list, rows)]
    widths = [max(map(columns, column)) for column in zip(*cells, strict=True)]
    return [
        _GAP.join(cell + " " * (width - columns(cell)) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in cells
    ]


def painted(line: PictureLine, width: int, colour: bool) -> str:
    """Return the text of a line that fits into `width` columns, in its `colour` if that is wanted."""
    text = fitted(line.text, width)
    return f"{line.colour}{text}{_RESET}" if colour and line.colour and text else text


@dataclass(frozen=True, slots=True)
class ShareView:
    """A share: the last answer of its host, as `top --json` writes it, its age [s], and what is wrong."""

    robot: str
    host: str
    answer: TopData | None
    age: float
    problem: str = ""

    @property
    def state(self) -> str:
        """Return how it is, in words."""
        if self.problem:
            return self.problem
        if self.age > SILENT:
            return f"does not answer for {self.age:.0f} s"
        if self.answer is None:
            return "asked"
        off = [str(component["name"]) for component in self.answer["components"] if component["state"] != "active"]
        dead = "" if self.answer["is_supervised"] else "its supervisor is dead"
        return dead or (f"{', '.join(off)} not active" if off else "up")

    @property
    def is_silent(self) -> bool:
        """Return whether nothing is known of it now."""
        return self.answer is None or bool(self.problem) or self.age > SILENT


def system_lines(name: str, shares: Sequence[ShareView], width: int, height: int, *, colour: bool = False) -> list[str]:
    """Return at most `height` lines of at most `width` columns; what does not fit is counted."""
    head = [PictureLine(f"{plain(name)}: {len(shares)} shares", BOLD), *_shares(shares), PictureLine("")]
    tail = _share_warnings(shares)
    components = shortened(_share_components(shares), max(2, height - len(head) - len(tail)))
    return [painted(line, width, colour) for line in [*head, *components, *tail][:height]]


def _shares(shares: Sequence[ShareView]) -> list[PictureLine]:
    rows = []
    for share in shares:
        answer = share.answer if share.answer is not None and not share.is_silent else {}
        loads = answer.get("processes", ())
        cpu = sum(each["cpu"] or 0.0 for each in loads)
        memory = sum(each["memory"] for each in loads) / 1e6
        use = (f"{cpu:.0%}", f"{memory:.0f} MB") if loads else ("-", "-")
        batteries = ", ".join(map(str, answer.get("batteries", {}).values()))
        rows.append((share.robot, share.host, *use, batteries, str(answer.get("mission") or ""), share.state))
    colours = (RED if view.is_silent else "" if view.state == "up" else YELLOW for view in shares)
    return _table([("robot", "host", "cpu", "memory", "battery", "mission", "state"), *rows], colours)


def _share_components(shares: Sequence[ShareView]) -> list[PictureLine]:
    rows, colours = [], []
    for share in shares:
        for component in share.answer["components"] if share.answer is not None and not share.is_silent else ():
            rows.append((share.robot, share.host, component["name"], component["state"], *_facts(component)))
            colours.append(ALARMS.get(component["level"], "") if component["state"] == "active" else YELLOW)
    return _table([("robot", "host", "component", "state", "restarts", "msg/s", ""), *rows], colours)


def _share_warnings(shares: Sequence[ShareView]) -> list[PictureLine]:
    """Return the last warnings of each share: their times count from its own start, so they are not mixed."""
    lines = []
    for share in shares:
        for entry in share.answer["warnings"][-MOST_WARNINGS:] if share.answer and not share.is_silent else ():
            text = f"{share.robot} {share.host} {entry['time']:8.1f}  {entry['source']}: {entry['text']}"
            lines.append(PictureLine(plain(text), ALARMS.get(entry["level"], "")))
    return _apart(lines)


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

    def sample(self) -> TopData | None:
        """Return the current picture, or None if the robot is down."""
        now, state = self._guest.clock.now(), known_state(self._folder)
        if state is None:
            return None
        elapsed = None if self._then is None else now - self._then
        self._then = now
        graph = self._guest.graph()
        self._gauges = {battery.topic: battery for battery in state.batteries.values()}
        for topic in graph.topics:
            is_wanted = topic.name == _HEALTH or topic.name in self._gauges or _is_light(topic)
            if topic.name not in self._listened and topic.givers and is_wanted:
                self._listened.add(topic.name)
                self._guest.listen(topic, partial(self._receive, topic.name))
        self._warnings.extend(record for record in self._follower.read() if record.level is not Level.OK)
        return self._picture(state, self._rates(graph, elapsed), self._loads(state, elapsed))

    def _running(self, state: RobotState) -> list[TopData]:
        """Follow the missions, if the robot has any, and return the running ones while their process lives."""
        alive = state.alive()
        if not any(component.name == state.executive and component.process in alive for component in state.components):
            return []
        if self._missions is None:
            self._missions = MissionsSeen(self._guest, state.robot)
        self._missions.look()
        active = {name: seen for name, seen in self._missions.by_name.items() if seen["state"] in ACTIVE}
        return [_running_mission(name, seen) for name, seen in sorted(active.items())]

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
            name = end.node.rpartition("/")[2]
            rates[name] = rates.get(name, 0.0) + self._counts[end.gid] / elapsed
        self._counts.clear()
        return rates

    def _loads(self, state: RobotState, elapsed: float | None) -> list[TopData]:
        loads, times = list[TopData](), {}
        for name, process in {_SUPERVISOR: state.supervisor, **state.processes}.items():
            usage = process.usage
            if usage is not None:
                times[process], memory = usage
                before = self._times.get(process)
                cpu = None if elapsed is None or before is None else (times[process] - before) / elapsed
                loads.append({"process": name, "pid": process.pid, "cpu": cpu, "memory": memory})
        self._times = times
        return loads

    def _picture(self, state: RobotState, rates: Mapping[str, float], loads: list[TopData]) -> TopData:
        leaves = {name.rpartition("/")[2]: status for name, status in self._statuses.items() if name.count("/") > 1}
        alive = state.alive()
        components = [
            _picture_of(component, component.process in alive, rates, leaves.get(component.name))
            for component in state.components
        ]
        missions = [each["message"] for each in components if each["name"] == state.executive and each["message"]]
        batteries = {
            name: f"{100 * self._charges[battery.topic]:.1f} %"
            for name, battery in state.batteries.items()
            if battery.topic in self._charges
        }
        groups = [status for status in self._statuses.values() if status.name.count("/") == 1]
        return {
            "robot": state.robot,
            "is_supervised": state.is_supervised,
            "router": state.router if "router" in alive or "router" not in state.processes else None,
            "mission": missions[0] if missions else "",
            "missions": self._running(state),
            "batteries": batteries,
            "components": components,
            "processes": loads,
            "diagnostics": [
                {"group": group.name.lstrip("/"), "level": level_of(group.level).name, "message": group.message}
                for group in groups
            ],
            "warnings": [
                {"time": warning.time, "level": warning.level.name, "source": warning.source, "text": warning.text}
                for warning in self._warnings
            ],
        }


def _is_light(topic: GraphName) -> bool:
    return all(end.qos is not None and end.qos.is_reliable and not end.qos.is_transient_local for end in topic.givers)


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


def _running_mission(name: str, seen: Mapping[str, Any]) -> TopData:
    picture = picture_from_data(seen["picture"])
    running = running_lines(picture, status_list(seen, picture.count), _WIDEST)
    return {"mission": name, "state": seen["state"], "running": running}


def _picture_of(
    state: ComponentState, is_alive: bool, rates: Mapping[str, float], status: DiagnosticStatus | None
) -> TopData:
    return {
        "name": state.name,
        "type": state.type,
        "state": state.state if is_alive else "dead",
        "process": state.process,
        "restarts": state.restarts,
        "rate": rates.get(state.name) if is_alive else None,
        "level": None if status is None else level_of(status.level).name,
        "message": "" if status is None else status.message,
    }


class MissionsSeen:
    """Follows all missions of a robot; `by_name` has the state of those that have been running."""

    def __init__(self, guest: Guest, robot: str) -> None:
        self._guest, self._robot = guest, robot
        self._replicas: dict[str, Replica] = {}
        self._asked: dict[str, object] = {}  # the query whose answer is awaited, by path
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
        query = self._asked[path] = object()
        answered, transport = partial(self._answered, path, query), self._guest.transport
        inbox: Inbox[TransportReply] = Inbox(VISITOR, None, answered, self._guest.scheduler.post)
        take, key = lambda answer: inbox.put(answer, transport.wake), admin_key(self._robot, path)
        transport.ask(key, b"", b"", take, of_all=True, within=LONGEST_WAIT)

    def _answered(self, path: str, query: object, answer: TransportReply) -> None:
        """Apply the first answer to a query, which ends with an error even after one."""
        if self._asked.get(path) is not query:
            return
        del self._asked[path]
        if answer.error or (message := _read(answer.payload)) is None:
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
