"""The aggregator of the robot's diagnostics."""

from __future__ import annotations

from pydantic import Field

from rbxcompose.diagnostics.core import DEFAULT_TIMEOUT, Aggregator, Analyzer
from rbxcompose.diagnostics.requests import DiagnosticsTree, ShowDiagnostics, TreeLine
from rbxcompose.diagnostics.status import Status
from rbxcompose.levels import Level, level_of
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus, KeyValue
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk import Component, Config, In, Out, Time, answers, component

PERIOD = 1.0  # [s] between two reports when nothing changes


class AnalyzerConfig(Config):
    """One group."""

    match: tuple[str, ...] = Field(min_length=1)
    """Names of components, or patterns with `*`."""
    timeout: Time = Field(DEFAULT_TIMEOUT, gt=0)
    """A component that is silent for longer than this is STALE."""
    expected: tuple[str, ...] = ()
    """Names that must report, whatever matches."""


class DiagnosticsConfig(Config):
    """Groups of the aggregated tree."""

    analyzers: dict[str, AnalyzerConfig] = {}
    """Groups by name; what none of them matches is in `Other`."""
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
    diagnostics = In(DiagnosticArray, "/diagnostics", is_open=True)
    diagnostics_agg = Out(DiagnosticArray, "/diagnostics_agg")

    def configure(self) -> None:
        """Build the core."""
        self.core = Aggregator(self.analyzers(), started=self.now)
        self.told: dict[str, Level] = {}
        self.is_going_down = False
        self.reported = self.now - PERIOD

    def analyzers(self) -> dict[str, Analyzer]:
        """Return the configured groups; each expects the robot's components that it matches."""
        return {
            name: Analyzer(
                match=one.match,
                expected=(
                    *one.expected,
                    *(part for part in self.config.expected if Analyzer(one.match).matches(part)),
                ),
                timeout=one.timeout,
            )
            for name, one in self.config.analyzers.items()
        }

    def on_diagnostics(self, message: DiagnosticArray) -> None:
        """Take statuses and report immediately if a group's level has changed."""
        self.core.feed(self.now, map(status_of, message.status))
        self.step(0.0)

    def lost(self, names: tuple[str, ...], cause: str) -> None:
        """Mark lost components as STALE immediately."""
        self.core.lost(self.now, names, cause)
        self.step(0.0)

    def brake(self) -> None:
        """Report no improvement from now on: a component that falls silent because it ends has not recovered."""
        self.is_going_down = True

    def step(self, dt: float) -> None:
        """Report once a second, and immediately when a group's level has changed."""
        if self.core.changed(self.now) or self.now - self.reported >= PERIOD:
            self.report()

    def report(self) -> None:
        """Publish the tree; log a group's new level to the story."""
        self.reported = self.now
        tree = self.core.report(self.now)
        header = Header(stamp=to_time(self.stamp))
        self.diagnostics_agg(DiagnosticArray(header=header, status=tuple(map(message_of, tree))))
        for group in (one for one in tree if one.name.count("/") == 1):
            told = self.told.get(group.name, Level.OK)
            if self.is_going_down and group.level < told:
                continue
            if group.level is not told:
                self.context.log(group.level, f"{group.name} is {group.level.name}: {group.message}")
            self.told[group.name] = group.level

    @answers(ShowDiagnostics)
    def show(self, request: ShowDiagnostics) -> DiagnosticsTree:
        """Return the tree as it is now."""
        level = self.core.top_level(self.now)
        lines = tuple(_line(status) for status in self.core.report(self.now))
        worst = next((one for one in lines if one.is_group and one.level is level), None)
        cause = "" if worst is None or level is Level.OK else f"{worst.path}: {worst.message}"
        return DiagnosticsTree(self.now, level, cause, lines, self.core.dropped)


def _line(status: Status) -> TreeLine:
    depth = status.name.count("/") - 1
    name = status.name.rpartition("/")[2]
    return TreeLine(
        status.name, name, depth, depth == 0, status.level, status.message, status.hardware_id, status.values
    )


def status_of(message: DiagnosticStatus) -> Status:
    """Return a status from its message."""
    values = tuple((pair.key, pair.value) for pair in message.values)
    return Status(message.name, level_of(message.level), message.message, message.hardware_id, values)


def message_of(status: Status) -> DiagnosticStatus:
    """Return a status as a message."""
    values = tuple(KeyValue(key=key, value=value) for key, value in status.values)
    return DiagnosticStatus(
        level=int(status.level),
        name=status.name,
        message=status.message,
        hardware_id=status.hardware_id,
        values=values,
    )
