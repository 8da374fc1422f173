"""List the extras of rbxcompose that a robot needs, why, and whether they are installed.

PATH is a robot, a system (all of its robots), a mission or a part (the robots that use it), or a folder.
pip install "$(rbxcompose needs PATH --pip)" installs them. Exit codes: 0 fine, 1 errors found, 2 wrong usage.
"""

import argparse
import json
import os
from collections.abc import Iterable, Iterator, Sequence
from importlib.util import find_spec

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Report, Severity
from rbxcompose.commands.console import FINDINGS, emit, table, write_report
from rbxcompose.commands.options import add_json_option
from rbxcompose.commands.targets import add_layer_options, compiled, targets
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.sdk import registry
from rbxcompose.sdk.capabilities import NeedsExtra

GROUP = "run"


@dataclass(frozen=True, slots=True)
class NeededExtra:
    """An extra, the components that need it, and those of its modules that are not installed."""

    name: str
    by: tuple[str, ...]
    missing: tuple[str, ...]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("paths", nargs="*", default=["."], metavar="PATH", help="whose extras; else the robots here")
    parser.add_argument("--missing", action="store_true", help="only those that are not installed")
    parser.add_argument("--pip", action="store_true", help="print it for pip; with --missing, nothing if all is here")
    add_layer_options(parser)
    add_json_option(parser)


def run(arguments: argparse.Namespace) -> int:
    """Compile the robots, and print what they need."""
    report, sources = Report(), dict[str, str]()
    robots = list(_robots(arguments, report, sources))
    report = Report([finding for finding in report if finding.severity is Severity.ERROR])
    if report.has_errors:
        write_report(report, sources)
        return FINDINGS
    found = [one for one in needed(robots) if one.missing or not arguments.missing]
    if arguments.json:
        emit(json.dumps([{"extra": item.name, "by": item.by, "missing": item.missing} for item in found]))
    elif arguments.pip:
        extras = f"[{','.join(item.name for item in found)}]" if found else ""
        emit("" if arguments.missing and not found else f"rbxcompose{extras}")
    elif not found:
        emit("nothing beside rbxcompose itself")
    else:
        state = [f"lacks {', '.join(item.missing)}" if item.missing else "installed" for item in found]
        rows = [(one.name, ", ".join(one.by), text) for one, text in zip(found, state, strict=True)]
        emit(table([("extra", "needed by", "here"), *rows]))
    return 0


def needed(robots: Iterable[Robot]) -> list[NeededExtra]:
    """Return the extras that robots need, by name."""
    by: dict[str, dict[str, None]] = {}
    modules: dict[str, dict[str, None]] = {}
    for component, one in (each for robot in robots for each in robot.declared(NeedsExtra)):
        by.setdefault(one.extra.value, {})[component.name] = None
        modules.setdefault(one.extra.value, {})[one.module.value] = None
    return [
        NeededExtra(name, tuple(by[name]), tuple(each for each in modules[name] if find_spec(each) is None))
        for name in sorted(by)
    ]


def requirements(robots: Sequence[Robot], version: str) -> list[str]:
    """Return what pip must install: rbxcompose with the extras of robots, and packages of their types and skills."""
    extras = ",".join(item.name for item in needed(robots))
    types = {component.type_name for robot in robots for component in robot.components.values()}
    used = ((registry.PLUGINS, types), (registry.SKILL_PLUGINS, {name for robot in robots for name in robot.skills}))
    entries = [
        entry
        for plugins, names in used
        for name in names - plugins.shipped.keys()
        for entry in plugins.third_party.get(name, ())
    ]
    foreign = {f"{entry.dist.name}=={entry.dist.version}" for entry in entries if entry.dist}
    return [f"rbxcompose{f'[{extras}]' if extras else ''}=={version}", *sorted(foreign)]


def _robots(arguments: argparse.Namespace, report: Report, sources: dict[str, str]) -> Iterator[Robot]:
    from rbxcompose.compiler.systems.reader import compile_system  # only needed for systems

    wanted = targets(arguments.paths)
    for path, *overlays in (*((path,) for path in (*wanted.robots, *wanted.users)), *wanted.overlays):
        compilation = compiled(path, arguments, *overlays)
        if path in wanted.users and not overlays and not any(file in compilation.sources for file in wanted.files):
            continue
        report.extend(compilation.report)
        sources.update(compilation.sources)
        if compilation.robot is not None:
            yield compilation.robot
    for path in wanted.systems:
        system = compile_system(path, environment=os.environ, real=arguments.real)
        report.extend(system.report)
        sources.update(system.sources)
        yield from (placed_robot.robot for placed_robot in system.robots.values())
    report.extend(wanted.unused(sources))
