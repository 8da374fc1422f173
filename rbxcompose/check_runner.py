"""Checks: rules about the whole robot, one file each in `checks/`, declared by one decorator."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable

from rbxcompose.findings import Finding, Report, Severity
from rbxcompose.missions.analysis.check_runner import check_program
from rbxcompose.model.robot import Robot
from rbxcompose.plugins import LEFT_OUT, BrokenPluginError, Plugins
from rbxcompose.printable import plain
from rbxcompose.rules import Rule, declared

Check = Rule[Robot]
Find = Callable[[Robot], Iterable[Finding]]

PLUGINS = Plugins("check", "rbxcompose.checks")
OWN = "RBX"  # prefix of the codes of this project
_CODE = re.compile(r"[A-Z]+\d+")


CHECKS: dict[str, Check] = {}  # every check that has been imported, by code


def check(code: str, severity: Severity = Severity.ERROR, *, is_fixable: bool = False) -> Callable[[Find], Check]:
    """Declare a rule under its code.

    Codes that begin with `RBX` are those of this project; others start with their own word (`LAMP01`).

    Raises:
        ValueError: if it has no docstring, or its code is taken, malformed or reserved.
    """

    def declare(find: Find) -> Check:
        if not _CODE.fullmatch(code):
            raise ValueError(f"'{code}' is not a code: a code is capital letters followed by digits")
        if _is_foreign(find) and code.startswith(OWN):
            raise ValueError(f"the code {code} starts with {OWN}, which is reserved for this project")
        CHECKS[code] = declared(find, code, severity, is_fixable)
        return CHECKS[code]

    return declare


def all_checks() -> list[Check]:
    """Import every check, except broken ones of other packages, and return them by code."""
    for name in PLUGINS.names():
        _problem(name)
    return [CHECKS[code] for code in sorted(CHECKS)]


def broken_checks() -> list[Finding]:
    """Return a finding for each check of another package that is left out."""
    return [LEFT_OUT.at(None, told) for name in sorted(PLUGINS.third_party) if (told := _problem(name))]


def _problem(name: str) -> str:
    """Import a check; return why it is left out, or nothing."""
    try:
        PLUGINS.load(name)
    except BrokenPluginError as error:
        return str(error)
    return PLUGINS.overshadowed(name)


def run_checks(robot: Robot, report: Report) -> None:
    """Add the findings of the checks on missions and on the robot.

    Warnings are reported only if there are no errors, since an error might cause them.
    """
    missions = [one for mission in robot.missions.values() for one in check_program(mission.program, robot.names)]
    for severity in (Severity.ERROR, Severity.WARNING):
        if severity is Severity.WARNING and report.has_errors:
            break
        report.extend(finding for finding in missions if finding.severity is severity)
        for one in all_checks():
            if one.severity is severity:
                report.extend(_found(one, robot))
    report.extend(broken_checks())


def _found(one: Check, robot: Robot) -> list[Finding]:
    """Return the findings of a check. If one of another package raises an error, the rest still run."""
    if not _is_foreign(one.find):
        return list(one(robot))
    try:
        return list(one(robot))
    except Exception as error:  # third-party code may raise anything
        reason = plain(f"{type(error).__name__}: {error}")
        return [LEFT_OUT.at(None, f"the check {one.code} of '{_package(one.find)}' has failed: {reason}")]


def _is_foreign(find: Find) -> bool:
    return _package(find) != __package__


def _package(find: Find) -> str:
    return find.__module__.partition(".")[0]
