"""Checks: rules about the whole robot, one file each in `checks/`, declared by one decorator.

A check is a function from the robot to findings; its docstring is the docs page of its code.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from rbxcompose.findings import Finding, Kind, Report, Severity, register_kind
from rbxcompose.model.robot import Robot
from rbxcompose.plugins import Plugins

Rule = Callable[[Robot], Iterable[Finding]]

PLUGINS = Plugins("check", "rbxcompose.checks")


@dataclass(frozen=True, slots=True)
class Check(Kind):
    """A kind of finding together with the rule that finds it."""

    rule: Rule = lambda robot: ()

    def __call__(self, robot: Robot) -> Iterable[Finding]:
        """Yield what is wrong with `robot`."""
        return self.rule(robot)


CHECKS: dict[str, Check] = {}  # every check that has been imported, by code


def check(code: str, severity: Severity = Severity.ERROR, *, is_fixable: bool = False) -> Callable[[Rule], Check]:
    """Declare a rule under its code.

    Raises:
        ValueError: if it has no docstring or its code is taken.
    """

    def declare(rule: Rule) -> Check:
        if not rule.__doc__:
            raise ValueError(f"check {code} has no docstring, so it would have no docs page")
        made = Check(code, inspect.cleandoc(rule.__doc__), severity, is_fixable, rule=rule)
        register_kind(made)
        CHECKS[code] = made
        return made

    return declare


def all_checks() -> list[Check]:
    """Import every check and return them by code."""
    for name in PLUGINS.names():
        PLUGINS.load(name)
    return [CHECKS[code] for code in sorted(CHECKS)]


def run_checks(robot: Robot, report: Report) -> None:
    """Add what the checks find; warnings only about a robot without errors, from which they might follow."""
    for severity in (Severity.ERROR, Severity.WARNING):
        for one in all_checks():
            if one.severity is severity and not (severity is Severity.WARNING and report.has_errors):
                report.extend(one(robot))
