"""Checks of a mission on a robot before it runs: rules, one file each in `missions/checks`."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterable
from functools import cache

from rbxcompose.findings import Finding, FindingKind, Severity
from rbxcompose.missions import checks as package
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.program.program import Program, RobotNames
from rbxcompose.rules import Rule, belonging, declared

MissionCheck = Rule[Examined]
Find = Callable[[Examined], Iterable[Finding]]

_CHECKS: dict[str, MissionCheck] = {}


def mission_check(
    kind: str | FindingKind, severity: Severity = Severity.ERROR, *, is_fixable: bool = False
) -> Callable[[Find], MissionCheck]:
    """Declare a rule under its own code, or under a kind of finding that reading a mission also reports.

    Raises:
        ValueError: if it has no docs page, or another rule has its code.
    """

    def declare(find: Find) -> MissionCheck:
        made = belonging(find, kind) if isinstance(kind, FindingKind) else declared(find, kind, severity, is_fixable)
        if _CHECKS.setdefault(made.code, made) is not made:
            raise ValueError(f"two rules have the code {made.code}")
        return made

    return declare


@cache
def mission_checks() -> tuple[MissionCheck, ...]:
    """Import all rules, and return them by code."""
    for module in pkgutil.iter_modules(package.__path__):
        importlib.import_module(f"{package.__name__}.{module.name}")
    return tuple(_CHECKS[code] for code in sorted(_CHECKS))


def check_program(program: Program, robot: RobotNames) -> list[Finding]:
    """Return all findings about a mission on this robot, in the order of the text."""
    mission = Examined(program, robot)
    return sorted((finding for one in mission_checks() for finding in one(mission)), key=_place)


def _place(finding: Finding) -> tuple[str, int, int]:
    return (finding.span.file, finding.span.line, finding.span.column) if finding.span else ("", 0, 0)
