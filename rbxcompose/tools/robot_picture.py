"""Pure core: the snapshots of a robot and of a whole system that `top` shows, and their lines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.base.printable import columns, fitted, plain
from rbxcompose.runtime.log import Record

MOST_WARNINGS = 5
_GAP = "  "
_RESET = "\x1b[0m"
BOLD, FAINT, YELLOW, RED, _MAGENTA = "\x1b[1m", "\x1b[2m", "\x1b[33m", "\x1b[31m", "\x1b[35m"
COLOURS = {Level.OK: "", Level.WARN: YELLOW, Level.ERROR: RED, Level.STALE: _MAGENTA}
ALARMS = {level.name: text for level, text in COLOURS.items()}
_FAILED = frozenset({"failed", "dead", "lost"})
_MOST_OF_NAMES = 24  # columns


@dataclass(frozen=True, slots=True)
class ComponentPicture:
    """A component: the rate of its outgoing messages [1/s] and its diagnostics; None where unknown."""

    name: str
    type: str
    state: str
    process: str
    restarts: int
    rate: float | None = None
    level: Level | None = None
    message: str = ""


@dataclass(frozen=True, slots=True)
class Load:
    """A process: its share of one processor, None if not known yet, and its memory [B]."""

    process: str
    pid: int
    cpu: float | None
    memory: int


@dataclass(frozen=True, slots=True)
class Tree:
    """A running mission: its name, its state, and its running nodes as lines, from the outside in."""

    mission: str
    state: str
    running: Sequence[str]


@dataclass(frozen=True, slots=True)
class RobotPicture:
    """Everything shown: `health` has the level and text of each group of the diagnostics."""

    robot: str
    is_supervised: bool
    router: str | None
    mission: str
    batteries: Sequence[tuple[str, str]]
    components: Sequence[ComponentPicture]
    loads: Sequence[Load]
    health: Sequence[tuple[str, Level, str]]
    warnings: Sequence[Record]
    trees: Sequence[Tree] = ()

    def to_data(self) -> dict[str, Any]:
        """Return the picture for JSON, with levels by name."""
        return {
            "robot": self.robot,
            "is_supervised": self.is_supervised,
            "router": self.router,
            "mission": self.mission,
            "missions": [asdict(tree) for tree in self.trees],
            "batteries": dict(self.batteries),
            "components": [
                {**asdict(component), "level": None if component.level is None else component.level.name}
                for component in self.components
            ],
            "processes": [asdict(load) for load in self.loads],
            "diagnostics": [{"group": name, "level": level.name, "message": text} for name, level, text in self.health],
            "warnings": [
                {"time": warning.time, "level": warning.level.name, "source": warning.source, "text": warning.text}
                for warning in self.warnings
            ],
        }


@dataclass(frozen=True, slots=True)
class PictureLine:
    """A line, and the colour that it has on a terminal."""

    text: str
    colour: str = ""


def lines_of(picture: RobotPicture, width: int, height: int, *, colour: bool = False) -> list[str]:
    """Return at most `height` lines of at most `width` columns; count what does not fit.

    Missions get the room that all else leaves; components go last.
    """
    head = _head(picture)
    loads = [PictureLine(""), *_loads(picture.loads)]
    tail = [*_health(picture.health), *_warnings(picture.warnings)]
    room = max(2, height - len(head) - len(loads) - len(tail))
    components = shortened(_components(picture.components), room)
    left = height - len(head) - len(components) - len(loads) - len(tail)
    shown = [*head, *components, *loads, *_trees(picture.trees, left), *tail][:height]
    return [painted(line, width, colour) for line in shown]


def _head(picture: RobotPicture) -> list[PictureLine]:
    supervisor = "" if picture.is_supervised else "; its supervisor is dead, 'rbxcompose down' ends what is left"
    lines = [PictureLine(f"{plain(picture.robot)}: router {plain(picture.router or 'none')}{supervisor}", BOLD)]
    if picture.mission:
        lines.append(PictureLine(f"mission: {plain(picture.mission)}"))
    if picture.batteries:
        lines.append(PictureLine(_GAP.join(f"{plain(name)}: {plain(text)}" for name, text in picture.batteries)))
    return [*lines, PictureLine("")]


def _components(components: Sequence[ComponentPicture]) -> list[PictureLine]:
    rows = [
        (
            component.name,
            component.type,
            component.state,
            component.process,
            str(component.restarts),
            "-" if component.rate is None else f"{component.rate:.1f}",
            "" if component.level in (None, Level.OK) else f"{component.level.name}: {component.message}",
        )
        for component in components
    ]
    head, *lines = table_of([("component", "type", "state", "process", "restarts", "msg/s", ""), *rows])
    return [
        PictureLine(head, FAINT),
        *(PictureLine(line, _alarm(component)) for line, component in zip(lines, components, strict=True)),
    ]


def _alarm(component: ComponentPicture) -> str:
    if component.state in _FAILED:
        return RED
    return YELLOW if component.state != "active" else COLOURS[component.level or Level.OK]


def _loads(loads: Sequence[Load]) -> list[PictureLine]:
    rows = [
        (load.process, str(load.pid), "-" if load.cpu is None else f"{load.cpu:.1%}", f"{load.memory / 1e6:.0f} MB")
        for load in loads
    ]
    head, *lines = table_of([("process", "pid", "cpu", "memory"), *rows])
    return [PictureLine(head, FAINT), *map(PictureLine, lines)]


def _trees(trees: Sequence[Tree], room: int) -> list[PictureLine]:
    lines = [line for tree in trees for line in _tree(tree)]
    return [PictureLine(""), *shortened(lines, room - 1)] if lines and room > 1 else []


def _tree(tree: Tree) -> list[PictureLine]:
    head = PictureLine(f"mission {plain(tree.mission)}: {plain(tree.state)}", FAINT)
    return [head, *(PictureLine(plain(line)) for line in tree.running)]


def _health(health: Sequence[tuple[str, Level, str]]) -> list[PictureLine]:
    fine = [plain(name) for name, level, _ in health if level is Level.OK]
    lines = [
        PictureLine(f"{level.name} {plain(name)}: {plain(text)}", COLOURS[level])
        for name, level, text in health
        if level is not Level.OK
    ]
    lines += [PictureLine(f"OK {', '.join(fine)}")] if fine else []
    return [PictureLine(""), *lines] if lines else []


def _warnings(warnings: Sequence[Record]) -> list[PictureLine]:
    lines = [
        PictureLine(f"{warning.time:8.1f}  {plain(warning.source)}: {plain(warning.text)}", COLOURS[warning.level])
        for warning in warnings[-MOST_WARNINGS:]
    ]
    return [PictureLine(""), *lines] if lines else []


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


SILENT = 3.0  # [s] after which a host does not answer


@dataclass(frozen=True, slots=True)
class ShareView:
    """A share: the last answer of its host, as `top --json` writes it, its age [s], and what is wrong."""

    robot: str
    host: str
    answer: Mapping[str, Any] | None
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
    head, *lines = table_of([("robot", "host", "cpu", "memory", "battery", "mission", "state"), *rows])
    colours = (RED if view.is_silent else "" if view.state == "up" else YELLOW for view in shares)
    return [PictureLine(head, FAINT), *map(PictureLine, lines, colours)]


def _share_components(shares: Sequence[ShareView]) -> list[PictureLine]:
    rows, colours = [], []
    for share in shares:
        for component in share.answer["components"] if share.answer is not None and not share.is_silent else ():
            level, rate = component["level"], component["rate"]
            says = "" if level in (None, Level.OK.name) else f"{level}: {component['message']}"
            times = "-" if rate is None else f"{rate:.1f}"
            rows.append(
                (
                    share.robot,
                    share.host,
                    component["name"],
                    component["state"],
                    str(component["restarts"]),
                    times,
                    says,
                )
            )
            colours.append(ALARMS.get(level, "") if component["state"] == "active" else YELLOW)
    head, *lines = table_of([("robot", "host", "component", "state", "restarts", "msg/s", ""), *rows])
    return [PictureLine(head, FAINT), *map(PictureLine, lines, colours)]


def _share_warnings(shares: Sequence[ShareView]) -> list[PictureLine]:
    """Return the last warnings of each share: their times count from its own start, so they are not mixed."""
    found = [
        (share, warning)
        for share in shares
        if share.answer and not share.is_silent
        for warning in share.answer["warnings"][-MOST_WARNINGS:]
    ]
    lines = [
        PictureLine(
            plain(f"{share.robot} {share.host} {entry['time']:8.1f}  {entry['source']}: {entry['text']}"),
            ALARMS.get(entry["level"], ""),
        )
        for share, entry in found
    ]
    return [PictureLine(""), *lines] if lines else []
