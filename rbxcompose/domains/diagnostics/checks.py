"""Rules about groups of diagnostics and what belongs to them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from rbxcompose.base.config import ANALYZER
from rbxcompose.base.findings import NAMES, Finding, Related, Severity
from rbxcompose.base.units import FREQUENCY, TIME, format_quantity
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.checks.composition import dropped, taken_out
from rbxcompose.compiler.model.flow import setting_span
from rbxcompose.compiler.model.robot import Robot, RobotComponent
from rbxcompose.domains.diagnostics.sections.diagnostics import diagnostics
from rbxcompose.domains.diagnostics.settings import (
    SHOWN,
    AnalyzerModel,
    component_of,
    each_analyzer,
    fits,
    is_glob,
    matches,
)
from rbxcompose.manifest.reader import REPLACE
from rbxcompose.manifest.tree import KeyPath, SequenceNode
from rbxcompose.manifest.yaml_nodes import TOO_LARGE
from rbxcompose.sdk.capabilities import ExpectsRate
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.ports import Out

REPORTS = 1.0  # [s] between two reports of a component's status
_OF_ITEMS = ("match", "expected", "strip_prefix", "remove_prefix", "discard_stale", "count")
_OF_LEVELS = ("debounce", "latch", "suppressed_by")
_HIDDEN = ("timeout", "discard_stale", "count", "path", "remove_prefix", "analyzers", *_OF_LEVELS)
_WITHOUT_EFFECT = {
    "generic": ("analyzers",),
    "group": (*_OF_ITEMS, "timeout"),
    "other": ("match", "expected", "strip_prefix", "remove_prefix", "discard_stale", "analyzers"),
    "ignore": _HIDDEN,
    "discard": _HIDDEN,
}
_MOST_COMPARED = 200_000  # of patterns with names


@check("RBX5005")
def analyzer_timeout(robot: Robot) -> Iterator[Finding]:
    """An analyzer treats its components as stale between two reports."""
    for path, analyzer in each_analyzer(robot.manifest.contents.of(diagnostics).analyzers):
        if 0 < analyzer.timeout <= REPORTS:
            yield analyzer_timeout.at(
                robot.value("diagnostics", "analyzers", *path, "timeout"),
                f"analyzer '{path[-1]}' considers its components stale before they report again",
                label=f"they report every {format_quantity(REPORTS, TIME)}",
                help="make it several seconds, or omit it for 5 s",
            )


@check("RBX5012")
def count_of_items(robot: Robot) -> Iterator[Finding]:
    """A group would need more items than it may have."""
    for path, analyzer in each_analyzer(robot.manifest.contents.of(diagnostics).analyzers):
        least, most = analyzer.counted or (0, None)
        if most is not None and least > most:
            place = ("diagnostics", "analyzers", *path, "count")
            yield count_of_items.at(
                robot.value(*place, "min"),
                f"analyzer '{path[-1]}' needs at least {least} items, but may have no more than {most}",
                related=[Related(robot.value(*place, "max"), "the most")],
                help="swap them",
            )


@check("RBX5011")
def empty_analyzer(robot: Robot) -> Iterator[Finding]:
    """An analyzer does not say what belongs to it."""
    for path, analyzer in each_analyzer(robot.manifest.contents.of(diagnostics).analyzers):
        place = ("diagnostics", "analyzers", *path)
        if analyzer.kind == "group" and not analyzer.analyzers:
            help_text = "write 'analyzers:' with the groups below it, or omit 'type: group' and write 'match:'"
            yield empty_analyzer.at(robot.key(*place), f"group '{path[-1]}' has no groups below it", help=help_text)
        elif analyzer.kind not in ("group", "other") and not (
            analyzer.match or analyzer.expected or analyzer.strip_prefix
        ):
            help_text = "write 'match:' with names of components, such as 'match: [battery]'"
            yield empty_analyzer.at(robot.key(*place), f"analyzer '{path[-1]}' matches nothing", help=help_text)


@check("RBX5003", is_fixable=True, closed=(NAMES,))
def expected_component(robot: Robot) -> Iterator[Finding]:
    """An analyzer expects a component that the robot does not have."""
    if robot.manifest.contents.of(diagnostics).profile == "ros1":
        return
    known = {*robot.components, *robot.written, *robot.brought}
    for path, analyzer in each_analyzer(robot.manifest.contents.of(diagnostics).analyzers):
        for index, expected in enumerate(analyzer.expected):
            if expected.partition(": ")[0] not in known:
                yield expected_component.misspelt(
                    robot.value("diagnostics", "analyzers", *path, "expected", index),
                    f"analyzer '{path[-1]}' expects '{expected}', which the robot does not have",
                    expected,
                    known,
                    "components of this robot",
                )


@check("RBX5016", Severity.WARNING)
def expected_rate(robot: Robot) -> Iterator[Finding]:
    """A monitor expects another rate than its source declares."""
    for monitor, expects in robot.declared(ExpectsRate):
        end = monitor.end(expects.port)
        for writer in robot.writers.get(end.topic, ()) if end else ():
            sent = writer.port.rate if isinstance(writer.port, Out) else None
            wrong = expects.missed_by(sent) if sent is not None else None
            if wrong is None or sent is None:
                continue
            yield expected_rate.at(
                setting_span(robot, (monitor, wrong.field)),
                f"'{monitor.name}' expects {format_quantity(wrong.value, FREQUENCY)}, "
                f"but '{writer.instance}' publishes '{writer.topic}' at {format_quantity(sent, FREQUENCY)}",
                help=f"write '{format_quantity(sent, FREQUENCY)}', or change the source",
                related=[Related(robot.component_span(writer.instance), "the source")],
            )


@check("RBX5010")
def idle_analyzer_key(robot: Robot) -> Iterator[Finding]:
    """A key of an analyzer has no effect."""
    is_ros1 = robot.manifest.contents.of(diagnostics).profile == "ros1"
    for path, analyzer in each_analyzer(robot.manifest.contents.of(diagnostics).analyzers):
        for key, why, cure in _idle(analyzer, is_ros1):
            place = robot.key("diagnostics", "analyzers", *path, key)
            yield idle_analyzer_key.at(place, f"'{key}' of analyzer '{path[-1]}' has no effect: {why}", help=cure)


def _idle(analyzer: AnalyzerModel, is_ros1: bool) -> Iterator[tuple[str, str, str]]:
    """Yield the keys without effect, each with the reason and the cure."""
    written = [key for key in type(analyzer).model_fields if key in analyzer.model_fields_set]
    for key in written:
        if key in _WITHOUT_EFFECT[analyzer.kind]:
            cure = "omit it, or put it into the analyzers below" if analyzer.kind == "group" else "omit it"
            cure = "omit 'type'" if key == "analyzers" else cure
            yield key, f"it is of type '{analyzer.kind}'", cure
        elif is_ros1 and key in _OF_LEVELS:
            yield key, "the profile is 'ros1'", "remove it, or remove 'profile: ros1'"
        elif key == "discard_stale" and analyzer.discard_stale and not analyzer.timeout:
            yield key, "with 'timeout: 0' nothing is ever stale", "give it a timeout"
        elif key == "latch" and analyzer.latch and analyzer.path == "":
            yield key, "with 'path: \"\"' it has no header, and 'diag ack' no path", "give it a path"


@check("RBX5014", Severity.WARNING, closed=())
def ignored_analyzer(robot: Robot) -> Iterator[Finding]:
    """What is to be ignored is shown in `Other`."""
    if robot.manifest.contents.of(diagnostics).profile != "ros1":
        return
    for path, analyzer in each_analyzer(robot.manifest.contents.of(diagnostics).analyzers):
        if analyzer.kind == "ignore":
            yield ignored_analyzer.at(
                robot.value("diagnostics", "analyzers", *path, "type"),
                f"what '{path[-1]}' matches lands in 'Other': so it is with the profile 'ros1'",
                help="write 'type: discard', or list it in the section's 'ignore'",
            )


@check("RBX5004", Severity.WARNING, closed=())
def matched_twice(robot: Robot) -> Iterator[Finding]:
    """Two analyzers name the same component."""
    first: dict[str, tuple[tuple[str, ...], int]] = {}
    for path, analyzer in each_analyzer(robot.manifest.contents.of(diagnostics).analyzers):
        shown = analyzer.conditions if analyzer.kind in SHOWN else ()
        for index, pattern in enumerate(shown):
            if not isinstance(pattern, str):
                continue
            other = first.setdefault(pattern, (path, index))
            if other != (path, index):
                yield matched_twice.at(
                    robot.value("diagnostics", "analyzers", *path, "match", index),
                    f"'{pattern}' is matched twice, by analyzer '{other[0][-1]}' and by analyzer '{path[-1]}'",
                    help="remove one of them",
                    related=[
                        Related(robot.value("diagnostics", "analyzers", *other[0], "match", other[1]), "the first")
                    ],
                )


GroupPath = tuple[str, ...]


@check("RBX5013", is_fixable=True, closed=(ANALYZER,))
def suppression(robot: Robot) -> Iterator[Finding]:
    """A group is silenced by one that does not exist, or by itself."""
    groups = dict(_groups(robot.manifest.contents.of(diagnostics).analyzers, ()))
    for path, group in groups.items():
        name = group.suppressed_by
        if name is None:
            continue
        place = robot.value("diagnostics", "analyzers", *_keys(path), "suppressed_by")
        target = _target(groups, path, name)
        if target is None:
            known = {one[-1] for one in groups if one[:-1] == path[: len(one) - 1] and one != path[: len(one)]}
            message = f"there is no group '{name}' beside '{path[-1]}' or above it"
            yield suppression.misspelt(place, message, name, known, "groups there")
        elif circle := _circle(groups, path, target):
            names = " -> ".join(f"'{group_path[-1]}'" for group_path in (path, *circle))
            yield suppression.at(place, f"the level of '{path[-1]}' would depend on itself: {names}", help="omit it")


def _groups(analyzers: Mapping[str, AnalyzerModel], above: GroupPath) -> Iterator[tuple[GroupPath, AnalyzerModel]]:
    for name, analyzer in analyzers.items():
        if analyzer.kind in SHOWN:
            yield (*above, name), analyzer
            yield from _groups(analyzer.analyzers, (*above, name))


def _keys(path: GroupPath) -> list[str]:
    return [key for name in path[:-1] for key in (name, "analyzers")] + [path[-1]]


def _target(groups: Mapping[GroupPath, AnalyzerModel], path: GroupPath, name: str) -> GroupPath | None:
    """Return the group that a name means for another one: the nearest one beside it or beside what is above it."""
    places = ((*path[:length], name) for length in range(len(path) - 1, -1, -1))
    return next((place for place in places if place in groups), None)


def _circle(groups: Mapping[GroupPath, AnalyzerModel], start: GroupPath, first: GroupPath) -> list[GroupPath]:
    """Return the way on which the level of `first` depends on that of `start`; empty if it does not."""
    way: dict[GroupPath, GroupPath | None] = {first: None}
    waiting = [first]
    while waiting:
        path = waiting.pop()
        if path == start:
            found: list[GroupPath] = []
            last: GroupPath | None = path
            while last is not None:
                found.insert(0, last)
                last = way[last]
            return found
        below = [candidate for candidate in groups if candidate[:-1] == path]
        by = groups[path].suppressed_by
        target = _target(groups, path, by) if by is not None else None
        for group_path in (*below, *([target] if target is not None else [])):
            if group_path not in way:
                way[group_path] = path
                waiting.append(group_path)
    return []


@check("RBX5015", Severity.WARNING, closed=(NAMES,))
def too_few_items(robot: Robot) -> Iterator[Finding]:
    """A group needs more items than its components report."""
    for path, analyzer in each_analyzer(robot.manifest.contents.of(diagnostics).analyzers):
        least, _ = analyzer.counted or (0, None)
        names = {condition if isinstance(condition, str) else "" for condition in analyzer.conditions}
        is_plain = names <= robot.components.keys()  # then what it matches needs no comparison with all components
        if not least or not is_plain or not names or analyzer.analyzers or analyzer.expected or analyzer.strip_prefix:
            continue
        matched = [robot.components[name] for name in names]
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
    codes = (getattr(entry, "__code__", None) for cls in classes for entry in vars(cls).values())
    return any(code is not None and "watch" in code.co_names for code in codes)


@check("RBX5001", is_fixable=True, closed=(NAMES,))
def unmatched_analyzer(robot: Robot) -> Iterator[Finding]:
    """A pattern of an analyzer matches no component."""
    there = {*robot.components, *robot.written, *robot.brought}
    known = {name for name in there if name.isidentifier()}
    named_elsewhere = {
        re.sub(r"\W+", by, name) for name in there - known for by in ("", "_")
    }  # names that are reported where they stand
    compared = 0
    for path, analyzer in each_analyzer(robot.manifest.contents.of(diagnostics).analyzers):
        patterns = [(index, item) for index, item in enumerate(analyzer.conditions) if isinstance(item, str)]
        for index, pattern in patterns:
            place: KeyPath = ("diagnostics", "analyzers", *path, "match", index)
            if compared > _MOST_COMPARED:
                message = f"the patterns up to this one take more than {_MOST_COMPARED:,} comparisons with components"
                yield TOO_LARGE.at(robot.value(*place), message, help="use fewer patterns")
                return
            wanted = component_of(pattern)  # which details it has shows only while it runs
            tried = () if wanted in known or not is_glob(wanted) else known
            compared += len(tried)
            is_known = wanted in known or wanted in named_elsewhere
            if not is_known and not any(fits(wanted, component) for component in tried):
                yield unmatched_analyzer.misspelt(
                    robot.value(*place),
                    f"analyzer '{path[-1]}' matches no component with '{pattern}'",
                    pattern,
                    known,
                    "components of this robot",
                    taken=[condition for _, condition in patterns],
                )


@check("RBX5002", Severity.WARNING)
def unseen_component(robot: Robot) -> Iterator[Finding]:
    """A component belongs to no group of the diagnostics."""
    settings = robot.manifest.contents.of(diagnostics)
    groups = [model for _, model in each_analyzer(settings.analyzers)]
    named_conditions = [condition for group in groups for condition in (*group.conditions, *group.expected)]
    lost = taken_out(robot)
    named_elsewhere = (
        name for name, step in lost.items() if isinstance(step.node, SequenceNode) and step.node.tag == REPLACE
    )
    named = {*dropped(robot), *named_elsewhere, *(item for item in named_conditions if isinstance(item, str))}
    for name in robot.written - named if groups else ():
        is_left = not any(fits(item, name) for item in settings.ignore) and not any(matches(g, name) for g in groups)
        if name in robot.components and is_left and not any(group.kind == "other" for group in groups):
            here, step = robot.component_span(name), lost.get(name)
            by = f": {step.layer} has replaced the list that did" if step else ""
            yield unseen_component.at(
                step.span if step else here,
                f"no analyzer matches '{name}'{by}",
                help=f"put it into the 'match' of one of them: {', '.join(settings.analyzers)}",
                related=[Related(here, "the component")] if step else [],
            )
