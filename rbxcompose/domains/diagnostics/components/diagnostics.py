"""The aggregator of the robot's diagnostics."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from rbxcompose.base.findings import clauses, suggest
from rbxcompose.base.levels import Level
from rbxcompose.domains.diagnostics import requests
from rbxcompose.domains.diagnostics.settings import DiagnosticsModel
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus, KeyValue
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk import Component, In, MessageLimits, Out, Refused, answers, component
from rbxcompose.sdk.component import RECALLED_WITHIN

if TYPE_CHECKING:
    from rbxcompose.domains.diagnostics.core import TreeRow

PAUSE = 0.05  # [s] between two reports at least, so that flapping levels cost little
MOST_ARRAYS = 30.0  # [Hz] of one publisher: more takes too much of a core, as do larger ones
ARRAY = MessageLimits(size=200_000)
MOST_LOGGED = 100_000  # characters of an answer to people
ROUNDING = 1e-9  # [s]
PAUSE_PER_ROW = 0.0001  # [s]; a row is about 20 us of work, so reports never take more than a fifth of a core


class DiagnosticsConfig(DiagnosticsModel):
    """Groups of the aggregated tree."""

    expected: tuple[str, ...] = ()
    """Components that must report."""


@component("diagnostics")
class Diagnostics(Component[DiagnosticsConfig]):
    """Sorts the statuses of all components into groups and publishes the level of each: OK, WARN, ERROR or STALE.

    Example:
        health: {type: diagnostics, analyzers: {power: {match: [battery, charger]}}}
    """

    made_by = "Every robot runs one; its groups are those of the section `diagnostics`."
    rate = 5.0
    diagnostics = In(DiagnosticArray, "/diagnostics", is_open=True, max_rate=MOST_ARRAYS, limits=ARRAY)
    diagnostics_agg = Out(DiagnosticArray, "/diagnostics_agg")
    diagnostics_toplevel_state = Out(DiagnosticStatus, "/diagnostics_toplevel_state")
    diagnostics_changes = Out(DiagnosticArray, "/diagnostics_changes", qos="event")

    def configure(self) -> None:
        """Build the core."""
        from rbxcompose.domains.diagnostics.core import Aggregator  # which only a running robot needs
        from rbxcompose.domains.diagnostics.ros1 import Ros1Aggregator

        made = Ros1Aggregator if self.config.profile == "ros1" else Aggregator
        self.core: Aggregator | Ros1Aggregator = made(self.config, self.config.expected, started=self.now)
        self.levels: dict[str, Level] = {}
        self.is_going_down = False
        self.reported = self.alarmed = -math.inf  # the last report, and the last immediate one
        self.rows = 0  # of the last report
        self.published = 0  # changes of levels
        self.kept: tuple[requests.LatchedLevel, ...] = ()  # what the supervisor has, for a restart
        self.keeps_from = math.inf if self.context.is_again else -math.inf
        if self.context.is_again:
            cause = "has started again: earlier changes are forgotten"
            self.core.history.add(self.now, f"/{self.name}", Level.STALE, Level.OK, cause)

    def start(self) -> None:
        """Keep what is latched only after what was kept before a restart has come again."""
        self.keeps_from = min(self.keeps_from, self.now + RECALLED_WITHIN)

    def take_over(self, old: Diagnostics) -> None:
        """Keep what is known: statuses, levels of groups that stay, and the history."""
        self.levels, self.published, self.kept = old.levels, old.published, old.kept
        if type(self.core) is type(old.core):
            self.core.take_over(old.core, self.now)  # type: ignore[arg-type]
        else:
            self.core.history = old.core.history

    def on_diagnostics(self, message: DiagnosticArray) -> None:
        """Take statuses and report immediately if a group's level has changed."""
        self.core.feed(self.now, message.status)
        for reason in self.core.admission.news():
            self.warn(f"{reason}; `diag tree` counts them")
        self.settle()

    def lost(self, names: tuple[str, ...], cause: str) -> None:
        """Mark lost components as STALE immediately."""
        self.core.lost(self.now, names, cause)
        self.settle()

    def brake(self) -> None:
        """Report no improvement from now on: a component that falls silent because it ends has not recovered."""
        self.is_going_down = True

    def step(self, dt: float) -> None:
        """Notice what falls silent."""
        self.core.advance(self.now)
        self.settle()
        self.keep()

    def wake(self) -> None:
        """Report what could not be reported at once, or what comes more often than steps."""
        self.step(0.0)

    def settle(self) -> None:
        """Report if it is time: a new level of a group immediately, else `rate` times a second.

        After an immediate report there is a pause, longer after a long one.
        """
        pause = max(PAUSE, PAUSE_PER_ROW * self.rows)
        period = max(pause, 1.0 / self.config.rate)
        due = self.reported + period
        if self.core.has_news:
            due = min(due, self.alarmed + pause)
        if self.now >= due - ROUNDING:
            self.alarmed = self.now if self.core.has_news else self.alarmed
            self.report()
            due = self.now + period
        if self.core.has_news or period < 1.0 / Diagnostics.rate:
            self.context.wake_at(due)

    def report(self) -> None:
        """Publish the tree, the level of the robot and the changes; log a group's new level to the story."""
        self.reported, self.core.has_news = self.now, False
        rows = self.core.report(self.now)
        self.rows = len(rows)
        header = Header(stamp=to_time(self.stamp))
        self.diagnostics_agg(DiagnosticArray(header=header, status=tuple(row.status for row in rows)))
        level, cause = self.core.level()
        self.diagnostics_toplevel_state(DiagnosticStatus(int(level), "toplevel_state", cause))
        if changes := self.core.history.after(self.published):
            self.published = self.core.history.count
            self.diagnostics_changes(DiagnosticArray(header=header, status=tuple(map(_as_status, changes))))
        for row in rows:
            if row.is_group and row.depth == 0:
                self.log_level(row.status)
        self.keep()

    def keep(self) -> None:
        """Let the supervisor know what is latched, for a restart, if that has changed."""
        if self.now >= self.keeps_from and (latched := self.core.latched()) != self.kept:
            self.kept = latched
            self.context.repeat([requests.RecallLatches(latched)])

    def log_level(self, group: DiagnosticStatus) -> None:
        """Log a new level of a group."""
        level, reported = Level(group.level), self.levels.get(group.name, Level.OK)
        if self.is_going_down and level < reported:
            return
        if level is not reported:
            cause = "" if group.message == level.name else f": {group.message}"
            self.context.log(level, f"{group.name} is {level.name}{cause}")
        self.levels[group.name] = level

    @answers(requests.ShowDiagnostics)
    def show(self, request: requests.ShowDiagnostics) -> requests.DiagnosticsTree:
        """Return the tree as it is now; of too many lines, groups and the worst."""
        self.core.advance(self.now)
        rows = self.core.report(self.now)
        if self.config.profile == "ros1":
            rows = tuple(sorted(rows, key=lambda row: row.status.name.split("/")))
        level, cause = self.core.level()
        lines = [_line(row) for row in rows]
        worst_first = sorted(range(len(lines)), key=lambda index: (not lines[index].is_group, -lines[index].level))
        kept = sorted(_within(worst_first, [_size(line) for line in lines]))
        shown = tuple(lines[index] for index in kept)
        refused = self.core.admission.refused
        return requests.DiagnosticsTree(self.now, level, cause, shown, len(lines) - len(shown), refused)

    @answers(requests.ListChanges)
    def changes(self, request: requests.ListChanges) -> tuple[requests.LevelChange, ...]:
        """Return the first of the changes that are still known."""
        known = list(self.core.history.after(request.after))
        kept = _within(range(len(known)), [len(change.path) + len(change.cause) + 100 for change in known])
        return tuple(known[index] for index in kept)

    @answers(requests.RecallLatches)
    def recall(self, request: requests.RecallLatches) -> str:
        """Go on with what was latched before a restart."""
        self.core.recall(self.now, request.latched)
        self.settle()
        return "levels are latched as before the restart"

    @answers(requests.Acknowledge)
    def acknowledge(self, request: requests.Acknowledge) -> str:
        """Let latched levels follow the present."""
        path = f"/{request.path.strip('/')}" if request.path else ""
        known = self.core.paths()
        if path and path not in known:
            raise Refused(clauses(f"there is no group '{path}'", suggest(path, known, "groups")))
        done = self.core.acknowledge(self.now, path)
        self.settle()
        if not done:
            raise Refused(f"no level is latched at '{path}'" if path else "no level is latched")
        return f"acknowledged: {', '.join(done)}"


def _line(row: TreeRow) -> requests.TreeLine:
    status = row.status
    values = () if row.is_group else tuple((pair.key, pair.value) for pair in status.values)  # those of a group repeat
    level = Level(status.level)
    return requests.TreeLine(
        status.name, row.name, row.depth, row.is_group, level, status.message, status.hardware_id, values
    )


def _size(line: requests.TreeLine) -> int:
    texts = (line.path, line.name, line.message, line.hardware_id, *(text for pair in line.values for text in pair))
    return 150 + sum(map(len, texts))


def _within(order: Iterable[int], sizes: Sequence[int]) -> Iterator[int]:
    """Yield the first of `order` whose sizes an answer can hold."""
    left = MOST_LOGGED
    for index in order:
        left -= sizes[index]
        if left < 0:
            return
        yield index


def _as_status(change: requests.LevelChange) -> DiagnosticStatus:
    values = (("number", change.number), ("time", f"{change.time:.3f}"), ("old", change.old.name.lower()))
    return DiagnosticStatus(
        int(change.new), change.path, change.cause, values=tuple(KeyValue(key, str(value)) for key, value in values)
    )
