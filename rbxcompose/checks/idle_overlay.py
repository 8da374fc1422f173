"""A layer that changes nothing."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from rbxcompose.check_runner import check
from rbxcompose.composition.history import HistoryStep
from rbxcompose.composition.overlay import SET
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.model.robot import Robot


@check("RBX7001", Severity.WARNING, closed=())
def idle_overlay(robot: Robot) -> Iterator[Finding]:
    """A profile or an overlay sets a value to what it already is."""
    for before, after, path in changes(robot):
        match before.node, after.node:
            case ScalarNode(text=old, plain=was_plain), ScalarNode(text=new, plain=is_plain):
                if (old, was_plain) == (new, is_plain):
                    yield idle_overlay.at(
                        after.span,
                        f"{after.layer} sets '{path}' to the value that it already has",
                        help="remove it, or write another value",
                        related=[Related(before.span, f"the same in {before.layer}")],
                    )


def changes(robot: Robot) -> Iterator[tuple[HistoryStep, HistoryStep, str]]:
    """Yield each value of a layer and the earlier value it replaces, with the path; `--set` may repeat values."""
    for path in robot.manifest.history.paths:
        for before, after in pairwise(robot.manifest.history.of(path)):
            if after.span.file != SET:
                yield before, after, ".".join(map(str, path))
