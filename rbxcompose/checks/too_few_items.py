"""A group that needs more items than its components report."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.diagnostics.conditions import matches
from rbxcompose.diagnostics.settings import each_analyzer
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.robot import Robot, RobotComponent
from rbxcompose.rules import NAMES
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.ports import Out


@check("RBX5015", Severity.WARNING, closed=(NAMES,))
def too_few_items(robot: Robot) -> Iterator[Finding]:
    """A group needs more items than its components report."""
    for path, analyzer in each_analyzer(robot.manifest.diagnostics.analyzers):
        least, _ = analyzer.counted or (0, None)
        is_plain = all(isinstance(one, str) and one in robot.components for one in analyzer.conditions)
        matched = [one for one in robot.components.values() if matches(analyzer, one.name)]
        if not least or not is_plain or not matched or analyzer.analyzers or analyzer.expected or analyzer.strip_prefix:
            continue
        most = sum(map(_items, matched))
        if most < least and not any(map(_may_watch, matched)):
            keys = ("count",) if isinstance(analyzer.count, int) else ("count", "min")
            yield too_few_items.at(
                robot.value("diagnostics", "analyzers", *path, *keys),
                f"analyzer '{path[-1]}' needs {least} items, but what it matches reports no more than {most}",
                help=f"add the missing components to its 'match', or write {most}",
            )


def _items(component: RobotComponent) -> int:
    """Return how many statuses a component reports: its own, and those of its outputs with a declared rate."""
    return 1 + sum(isinstance(end.port, Out) and end.port.rate is not None for end in component.ends)


def _may_watch(component: RobotComponent) -> bool:
    """Return whether the code of a component adds statuses of its own, by `watch`."""
    classes = (one for one in component.cls.__mro__ if one is not Component)
    codes = (getattr(one, "__code__", None) for cls in classes for one in vars(cls).values())
    return any(code is not None and "watch" in code.co_names for code in codes)
