"""Checks of a mission on a robot before it runs: rules in the modules of `missions/checks`."""

import importlib
import pkgutil
from collections.abc import Callable, Iterable, Iterator
from functools import cache

from rbxcompose.base.findings import Finding, FindingKind, Rule, Severity, belonging, declared
from rbxcompose.missions import checks as package
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.program.program import Program, RobotNames

MissionCheck = Rule[Examined]
Find = Callable[[Examined], Iterable[Finding]]

_CHECKS: dict[str, MissionCheck] = {}


def mission_check(
    kind: str | FindingKind,
    severity: Severity = Severity.ERROR,
    *,
    is_fixable: bool = False,
    closed: tuple[str, ...] | None = None,
) -> Callable[[Find], MissionCheck]:
    """Declare a rule under its own code, or under a kind of finding that reading a mission also reports.

    `closed` is what it takes for known, see `Rule`.

    Raises:
        ValueError: if it has no docs page, or another rule has its code.
    """

    def declare(find: Find) -> MissionCheck:
        if isinstance(kind, FindingKind):
            made = belonging(find, kind, closed)
        else:
            made = declared(find, kind, severity, is_fixable, closed)
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
    return sorted((finding for _, finding in rule_findings(Examined(program, robot), mission_checks())), key=_place)


def rule_findings(mission: Examined, rules: Iterable[MissionCheck]) -> Iterator[tuple[MissionCheck, Finding]]:
    """Yield the findings of rules about a mission, each with its rule."""
    for check in rules:
        yield from ((check, finding) for finding in check(mission))


def _place(finding: Finding) -> tuple[str, int, int]:
    return (finding.span.file, finding.span.line, finding.span.column) if finding.span else ("", 0, 0)
