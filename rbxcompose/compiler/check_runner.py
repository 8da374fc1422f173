"""Checks: rules about the whole robot, one file each in `checks/`, declared by one decorator."""

import re
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from rbxcompose.base.findings import OUR_CODES, Finding, FindingKind, Report, Rule, Severity, belonging, declared
from rbxcompose.base.plugins import LEFT_OUT, Plugins, domain_of, package_of
from rbxcompose.base.printable import plain
from rbxcompose.compiler.doubts import Doubts, doubts_of, half_read
from rbxcompose.compiler.model.robot import NOTHING, Robot
from rbxcompose.manifest.registry import PLUGINS as SECTIONS
from rbxcompose.manifest.registry import section_named
from rbxcompose.missions.analysis.examined import Examined, mission_checks

T = TypeVar("T")
Check = Rule[Robot]
Find = Callable[[Robot], Iterable[Finding]]
FindBy = Callable[[Rule[Any], Robot | Examined], list[Finding]]

PLUGINS = Plugins("check", "checks")
_CODE = re.compile(r"[A-Z]+\d+")
EVERY_ROBOT = "every robot"


CHECKS: dict[str, Check] = {}  # every check that has been imported, by code


def check(
    code: str | FindingKind,
    severity: Severity = Severity.ERROR,
    *,
    is_fixable: bool = False,
    closed: tuple[str, ...] | None = None,
) -> Callable[[Find], Check]:
    """Declare a rule under its code, or under a kind of finding that reading a manifest also reports.

    Codes that begin with `RBX` are those of this project; others start with their own word (`LAMP01`). `closed` is what
    the rule takes for known, see `Rule`.

    Raises:
        ValueError: if it has no docstring, or its code is taken, malformed or reserved.
    """

    def declare(find: Find) -> Check:
        if isinstance(code, FindingKind):
            if CHECKS.setdefault(code.code, made := belonging(find, code, closed)) is not made:
                raise ValueError(f"two checks have the code {code.code}")
            return made
        if not _CODE.fullmatch(code):
            raise ValueError(f"'{code}' is not a code: a code is capital letters followed by digits")
        if is_foreign(find) and code.startswith(OUR_CODES):
            raise ValueError(f"the code {code} starts with {OUR_CODES}, which is reserved for this project")
        CHECKS[code] = declared(find, code, severity, is_fixable, closed)
        return CHECKS[code]

    return declare


def all_checks() -> list[Check]:
    """Import every check, except broken ones of other packages, and return them by code."""
    PLUGINS.load_shipped()
    for name in PLUGINS.third_party:
        _problem(name)
    return [CHECKS[code] for code in sorted(CHECKS)]


def checks_of(robot: Robot) -> list[Check]:
    """Return `all_checks` without those that can find nothing: of domains of which the robot has nothing.

    A domain's rules are about its sections and components, and about what its `RULES_ABOUT` says: `EVERY_ROBOT`, or
    names of capabilities. They are about other components, too, if they have what only components of this domain have
    otherwise: components of other packages may, and other robots' skills.
    """
    types = [component.cls for component in robot.components.values()]
    if robot.outside is not NOTHING or any(map(is_foreign, types)):
        return all_checks()
    sections = filter(None, map(section_named, robot.manifest.root.entries))
    used = {domain_of(part.__module__) for part in (*types, *(section.read for section in sections))} | {""}
    left_out = {domain_of(module) for module in SECTIONS.shipped.values()} - used
    left_out = {domain for domain in left_out if not _is_about(domain, robot)}
    names = {name for name, module in PLUGINS.shipped.items() if domain_of(module) in left_out}
    for name in sorted(PLUGINS.shipped.keys() - names):
        PLUGINS.load(name)
    for name in PLUGINS.third_party:
        _problem(name)
    silent = {PLUGINS.shipped[name] for name in names}  # they may have been imported for another robot
    return [CHECKS[code] for code in sorted(CHECKS) if CHECKS[code].find.__module__ not in silent]


def _is_about(domain: str, robot: Robot) -> bool:
    """Return whether a domain says of itself that its rules are about any robot, or about what this one declares."""
    declared = {EVERY_ROBOT, *(type(able).__name__ for part in robot.components.values() for able in part.capabilities)}
    return not declared.isdisjoint(getattr(package_of(domain), "RULES_ABOUT", ()))


def broken_checks() -> list[Finding]:
    """Return a finding for each check of another package that is left out."""
    return [LEFT_OUT.at(None, problem) for name in sorted(PLUGINS.third_party) if (problem := _problem(name))]


def _problem(name: str) -> str:
    """Import a check of another package; return why it is left out, or nothing."""
    if any(rule.find.__name__ == name and not is_foreign(rule.find) for rule in CHECKS.values()):
        return PLUGINS.left_out(name)
    return PLUGINS.problem(name)


def run_checks(robot: Robot, report: Report, find: FindBy | None = None) -> None:
    """Add the findings of the checks on missions and on the robot.

    Rules that conclude from what is there come first, then errors that conclude from what is not there, then warnings:
    each only if what it takes for known is known, in spite of the errors before it. A finding that rests on something
    in doubt may only follow from an error, so it is left out. A mission with a key that is written twice is not
    checked: half of something in it was not read. `find` may know the findings of a rule about the robot or a mission
    from before.
    """
    find = find or findings_of
    halves = half_read(report)
    programs = (mission.program for mission in robot.missions.values())
    missions = [Examined(program, robot.names) for program in programs if program.file not in halves]
    checks = checks_of(robot)
    for turn in range(_TURNS):
        doubts = doubts_of(robot.manifest, report)

        def reports(rule: Rule[Any], turn: int = turn, doubts: Doubts = doubts) -> bool:
            return _turn(rule) == turn and not doubts.bar(rule.relies_on)

        found: list[tuple[Rule[Any], Finding]] = []
        about_missions = [rule for rule in mission_checks() if reports(rule)]
        for mission in missions:
            found += [(rule, finding) for rule in about_missions for finding in find(rule, mission)]
        found += [(rule, finding) for rule in checks if reports(rule) for finding in find(rule, robot)]
        report.extend(finding for rule, finding in found if not doubts.touch(finding, rule.relies_on))
    report.extend(broken_checks())


_TURNS = 3


def _turn(rule: Rule[Any]) -> int:
    """Return when a rule has its turn: a later one is silent where earlier ones have found errors."""
    return _TURNS - 1 if rule.severity is Severity.WARNING else int(bool(rule.relies_on))


def findings_of(rule: Rule[Any], subject: Robot | Examined) -> list[Finding]:
    """Return the findings of a rule. If one of another package raises an error, the rest still run."""
    return answers_of(rule.find, f"check {rule.code}", lambda: rule(subject))


def answers_of(part: Callable[..., Any], what: str, ask: Callable[[], Iterable[T]]) -> list[T | Finding]:
    """Return the answers of a function, or a finding that it has failed if it is of another package."""
    try:
        return [*ask()]
    except Exception as error:  # third-party code may raise anything
        if not is_foreign(part):
            raise
        reason = plain(f"{type(error).__name__}: {error}")
        return [LEFT_OUT.at(None, f"the {what} of '{_package(part)}' has failed: {reason}")]


def is_foreign(part: Callable[..., Any]) -> bool:
    """Return whether something is of another package."""
    return _package(part) != _package(declared)


def _package(part: Callable[..., Any]) -> str:
    return part.__module__.partition(".")[0]
