"""Pure core: what `top` shows of a whole system, from what each host tells of its shares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rbxcompose.cli.robots.picture import (
    ALARMS,
    BOLD,
    FAINT,
    MOST_WARNINGS,
    RED,
    YELLOW,
    PictureLine,
    painted,
    shortened,
    table_of,
)
from rbxcompose.dataclass import dataclass
from rbxcompose.levels import Level
from rbxcompose.printable import plain

SILENT = 3.0  # [s] after which a host does not answer


@dataclass(frozen=True, slots=True)
class ShareView:
    """What is known of a share: what its host told last, as `top --json` does, how long ago [s], and what is wrong."""

    robot: str
    host: str
    told: Mapping[str, Any] | None
    age: float
    problem: str = ""

    @property
    def state(self) -> str:
        """Return how it is, in words."""
        if self.problem:
            return self.problem
        if self.age > SILENT:
            return f"does not answer for {self.age:.0f} s"
        if self.told is None:
            return "asked"
        off = [str(one["name"]) for one in self.told["components"] if one["state"] != "active"]
        dead = "" if self.told["is_supervised"] else "its supervisor is dead"
        return dead or (f"{', '.join(off)} not active" if off else "up")

    @property
    def is_silent(self) -> bool:
        """Return whether nothing is known of it now."""
        return self.told is None or bool(self.problem) or self.age > SILENT


def system_lines(name: str, shares: Sequence[ShareView], width: int, height: int, *, colour: bool = False) -> list[str]:
    """Return at most `height` lines of at most `width` columns; what does not fit is counted."""
    head = [PictureLine(f"{plain(name)}: {len(shares)} shares", BOLD), *_shares(shares), PictureLine("")]
    tail = _warnings(shares)
    components = shortened(_components(shares), max(2, height - len(head) - len(tail)))
    return [painted(line, width, colour) for line in [*head, *components, *tail][:height]]


def _shares(shares: Sequence[ShareView]) -> list[PictureLine]:
    rows = []
    for one in shares:
        told = one.told if one.told is not None and not one.is_silent else {}
        loads = told.get("processes", ())
        cpu = sum(each["cpu"] or 0.0 for each in loads)
        memory = sum(each["memory"] for each in loads) / 1e6
        use = (f"{cpu:.0%}", f"{memory:.0f} MB") if loads else ("-", "-")
        batteries = ", ".join(map(str, told.get("batteries", {}).values()))
        rows.append((one.robot, one.host, *use, batteries, str(told.get("mission") or ""), one.state))
    head, *lines = table_of([("robot", "host", "cpu", "memory", "battery", "mission", "state"), *rows])
    colours = (RED if one.is_silent else "" if one.state == "up" else YELLOW for one in shares)
    return [PictureLine(head, FAINT), *map(PictureLine, lines, colours)]


def _components(shares: Sequence[ShareView]) -> list[PictureLine]:
    rows, colours = [], []
    for share in shares:
        for one in share.told["components"] if share.told is not None and not share.is_silent else ():
            level, rate = one["level"], one["rate"]
            says = "" if level in (None, Level.OK.name) else f"{level}: {one['message']}"
            times = "-" if rate is None else f"{rate:.1f}"
            rows.append((share.robot, share.host, one["name"], one["state"], str(one["restarts"]), times, says))
            colours.append(ALARMS.get(level, "") if one["state"] == "active" else YELLOW)
    head, *lines = table_of([("robot", "host", "component", "state", "restarts", "msg/s", ""), *rows])
    return [PictureLine(head, FAINT), *map(PictureLine, lines, colours)]


def _warnings(shares: Sequence[ShareView]) -> list[PictureLine]:
    """Return the last warnings of each share: their times count from its own start, so they are not mixed."""
    found = [
        (share, one)
        for share in shares
        if share.told and not share.is_silent
        for one in share.told["warnings"][-MOST_WARNINGS:]
    ]
    lines = [
        PictureLine(
            plain(f"{share.robot} {share.host} {one['time']:8.1f}  {one['source']}: {one['text']}"),
            ALARMS.get(one["level"], ""),
        )
        for share, one in found
    ]
    return [PictureLine(""), *lines] if lines else []
