"""Aggregators fed with statuses, and their trees."""

from __future__ import annotations

from typing import Any

from rbxcompose.base.levels import Level
from rbxcompose.domains.diagnostics.core import Aggregator
from rbxcompose.domains.diagnostics.settings import DiagnosticsModel
from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus

OK, WARN, ERROR, STALE = Level
POWER = {"power": {"match": ["battery", "charger"]}}
Groups = dict[str, dict[str, Any]]


def status(name: str, level: int, message: str = "") -> DiagnosticStatus:
    return DiagnosticStatus(level, name, message)


def aggregator(analyzers: Groups = POWER, *, expected: tuple[str, ...] = (), **settings: Any) -> Aggregator:
    return Aggregator(DiagnosticsModel.model_validate({"analyzers": analyzers, **settings}), expected)


def fed(*statuses: DiagnosticStatus, analyzers: Groups = POWER, now: float = 0.0, **settings: Any) -> Aggregator:
    made = aggregator(analyzers, **settings)
    made.feed(now, statuses)
    return made


def tree(made: Aggregator, now: float) -> dict[str, tuple[Level, str]]:
    """Return the report by path, in its order."""
    made.advance(now)
    return {row.status.name: (Level(row.status.level), row.status.message) for row in made.report(now)}


def level(made: Aggregator, path: str, now: float) -> Level | None:
    return tree(made, now).get(path, (None,))[0]


def news(made: Aggregator) -> bool:
    """Return whether there is something to report, and report it."""
    found, made.has_news = made.has_news, False
    return found
