"""`diagnostics`: files of diagnostic_aggregator, for ROS 1 and ROS 2."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import field
from typing import TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Related, Report, Severity, Span, kind
from rbxcompose.base.printable import plain
from rbxcompose.commands.importing.foreign_files import ForeignFile, ForeignMap, FreeNames, Given, maps_in
from rbxcompose.commands.importing.importer import CLOCK, DISAGREES, NOT_CARRIED_OVER, OTHER_PROGRAM, importer
from rbxcompose.commands.importing.manifest_text import (
    WIDEST,
    Row,
    flag,
    flow,
    flow_list,
    header,
    place,
    quantity,
    row,
    section,
    word,
)
from rbxcompose.commands.importing.ros_parameters import NodeParameters, parameters_with
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode

REFUSED = kind("RBX2296", Severity.WARNING)
NO_REGEX = kind("RBX2297")

TYPES = {
    "GenericAnalyzer": "generic",
    "AnalyzerGroup": "group",
    "IgnoreAnalyzer": "ignore",
    "DiscardAnalyzer": "discard",
}
MATCHERS = ("startswith", "contains", "name", "regex")
_OF_ITEMS = ("remove_prefix", "timeout", "num_items", "discard_stale")
_WITHOUT_EFFECT = {  # in ROS either, by type
    "group": (*MATCHERS, "expected", "find_and_remove_prefix", *_OF_ITEMS),
    "discard": ("path", *_OF_ITEMS),
}
_BELOW = ("analyzers", "analyzers_params")
_MOST = 1_000_000  # items
_ELSEWHERE = {
    "critical": "with 'profile: modern' each change of a level is published at once",
    "history_depth": "'rbxcompose record' keeps changes of levels",
    "bond_id": "analyzers are tied to no other program",
}
_EVERYTHING = "{regex: '.*'}"  # what an empty beginning matches


@dataclass(slots=True)
class ForeignAnalyzer:
    """An analyzer: names by how they are matched, and what else is set."""

    name: str
    span: Span
    type: str
    path: Given[str] | None = None
    matched: dict[str, list[Given[str]]] = field(default_factory=dict)
    expected: list[Given[str]] = field(default_factory=list)
    stripped: list[Given[str]] = field(default_factory=list)
    removed: list[Given[str]] = field(default_factory=list)
    timeout: Given[float] | None = None
    count: Given[int] | None = None
    discards: Given[bool] | None = None
    below: list[ForeignAnalyzer] = field(default_factory=list)


@dataclass(slots=True)
class ForeignAggregator:
    """An aggregator: how often it publishes [Hz], the path above all, and its analyzers."""

    span: Span
    rate: Given[float] | None = None
    base: Given[str] | None = None
    other_is_error: Given[bool] | None = None
    analyzers: list[ForeignAnalyzer] = field(default_factory=list)


def read_aggregators(file: ForeignFile, report: Report) -> list[ForeignAggregator]:
    """Return the aggregators of a file; other nodes in it are reported, and so is a file without any."""
    found, others = parameters_with(file, lambda root: bool(_analyzers(root)))
    if not found:
        words = (
            f"'{plain(file.name)}' is not a file of diagnostic_aggregator: nothing in it has the type of an analyzer"
        )
        report.add(OTHER_PROGRAM.at(file.root.span, words))
        return []
    for node in others:
        report.add(NOT_CARRIED_OVER.at(node.span, f"'{plain(node.node, 60)}' is not carried over: it has no analyzers"))
    return [_aggregator(node, report) for node in found]


def _analyzers(node: MappingNode) -> dict[str, Entry]:
    """Return the analyzers of an aggregator or of a group, by their names."""
    found = {name: entry for name, entry in node.entries.items() if name not in _BELOW and _has_type(entry)}
    for key in _BELOW:
        if isinstance(below := node.get(key), MappingNode):
            found.update(below.entries)
    return found


def _has_type(entry: Entry) -> bool:
    type_ = entry.value.get("type") if isinstance(entry.value, MappingNode) else None
    return isinstance(type_, ScalarNode) and "Analyzer" in type_.text


def _aggregator(node: NodeParameters, report: Report) -> ForeignAggregator:
    root = node.root
    analyzers = _analyzers(root)
    others = {name: entry for name, entry in root.entries.items() if name not in (*_BELOW, *analyzers)}
    entries = ForeignMap(MappingNode(others, root.span), f"'{plain(node.node, 60)}'", node.span, report)
    base = entries.text("base_path")
    other = entries.text("path")
    found = ForeignAggregator(node.span, entries.above_zero("pub_rate"), base or other, entries.flag("other_as_errors"))
    if (time := entries.flag("use_sim_time")) is not None and time.value:
        report.add(NOT_CARRIED_OVER.at(time.span, f"'use_sim_time' is not carried over: {CLOCK}"))
    for key, span in entries.places(*_ELSEWHERE).items():
        report.add(NOT_CARRIED_OVER.at(span, f"'{key}' is not carried over: {_ELSEWHERE[key]}"))
    entries.report_unknown_keys()
    found.analyzers = list(_read(analyzers, report))
    return found


def _read(analyzers: dict[str, Entry], report: Report) -> Iterator[ForeignAnalyzer]:
    for name, entries in maps_in(MappingNode(analyzers), "analyzer", report):
        if (found := _analyzer(name, entries)) is not None:
            yield found


def _analyzer(name: str, entries: ForeignMap) -> ForeignAnalyzer | None:
    """Return an analyzer; None after the finding that says why it is left out."""
    type_ = _type(entries)
    if type_ is None:
        return None
    idle = entries.places(*_WITHOUT_EFFECT.get(type_, ()))
    for key, span in idle.items():
        entries.add(NOT_CARRIED_OVER.at(span, f"'{key}' of {entries.what} is not carried over: it has no effect"))
    others = {key: entry for key, entry in entries.node.entries.items() if key not in idle}
    entries = ForeignMap(MappingNode(others, entries.node.span), entries.what, entries.span, entries.report)
    entries.places("type")  # which is known
    analyzer = ForeignAnalyzer(name, entries.span, type_, entries.text("path"))
    for key in MATCHERS:
        analyzer.matched[key] = [each for each in _texts(entries, key) if key != "regex" or _is_regex(each, entries)]
    analyzer.expected, analyzer.stripped = _texts(entries, "expected"), _texts(entries, "find_and_remove_prefix")
    analyzer.removed = _texts(entries, "remove_prefix")
    analyzer.timeout, analyzer.discards = entries.number("timeout"), entries.flag("discard_stale")
    if analyzer.timeout and analyzer.timeout.value <= 0 and analyzer.discards and analyzer.discards.value:
        words = f"'discard_stale' of {entries.what} is not carried over: it has no effect, since nothing is ever stale"
        entries.add(NOT_CARRIED_OVER.at(analyzer.discards.span, words))
        analyzer.discards = None
    analyzer.count = entries.whole("num_items", -1, _MOST)
    below = _analyzers(entries.node) if type_ == "group" else {}
    if type_ == "group":
        entries.places(*_BELOW, *(below.keys() & entries.node.entries.keys()))
    entries.report_unknown_keys()
    analyzer.below = list(_read(below, entries.report))
    if type_ == "ignore":
        words = f"{entries.what} is not carried over: it matches nothing in ROS either, so its items are in Other"
        entries.add(NOT_CARRIED_OVER.at(entries.span, words))
        return None
    why = _why_refused(analyzer)
    if why:
        entries.add(REFUSED.at(entries.span, f"{entries.what} is left out: {why}"))
        return None
    return analyzer


def _type(entries: ForeignMap) -> str | None:
    given = entries.text("type")
    if given is None:
        entries.add(REFUSED.at(entries.span, f"{entries.what} is left out: it has no type"))
        return None
    name = given.value.rpartition("/")[2].rpartition(":")[2]
    if name not in TYPES:
        words = f"{entries.what} is not carried over: '{plain(given.value, 60)}' is an analyzer of another package"
        entries.add(NOT_CARRIED_OVER.at(given.span, words))
        return None
    return TYPES[name]


def _why_refused(analyzer: ForeignAnalyzer) -> str:
    """Return why the aggregator refuses an analyzer; empty if it does not."""
    if analyzer.type == "discard":
        return "" if _matches(analyzer) else "it matches nothing"
    if analyzer.path is None:
        return "it has no path"
    if analyzer.type == "generic" and not _matches(analyzer):
        return "it matches nothing"
    return "no analyzer is below it" if analyzer.type == "group" and not analyzer.below else ""


def _matches(analyzer: ForeignAnalyzer) -> bool:
    return bool(any(analyzer.matched.values()) or analyzer.expected or analyzer.stripped)


def _texts(entries: ForeignMap, key: str) -> list[Given[str]]:
    """Return a text, or the texts of a list."""
    if isinstance(entries.node.get(key), SequenceNode):
        return entries.texts(key)
    found = entries.text(key)
    return [] if found is None else [found]


def _is_regex(given: Given[str], entries: ForeignMap) -> bool:
    try:
        re.compile(given.value)
    except (re.error, RecursionError, OverflowError) as error:
        entries.add(NO_REGEX.at(given.span, f"'regex' of {entries.what} is left out: {error}"))
        return False
    return True


T = TypeVar("T")


@importer("diagnostics", "analyzers of diagnostic_aggregator, for ROS 1 and ROS 2")
def diagnostics(files: Sequence[ForeignFile], name: str, report: Report) -> str:
    """Return a robot with the analyzers of the files, which follow the rules of the aggregator to the letter."""
    found = {file.name: read_aggregators(file, report) for file in files}
    aggregators = [aggregator for ones in found.values() for aggregator in ones]
    rows = list(_diagnostics_analyzers([analyzer for each in aggregators for analyzer in each.analyzers], 2))
    if not rows:
        return ""
    made_from = [file for file, ones in found.items() if ones]
    head = [row(0, "diagnostics:"), row(1, "profile: ros1", "the rules of diagnostic_aggregator, to the letter")]
    text = section([*head, *_settings(aggregators, report), row(1, "analyzers:"), *rows])
    return f"{header('diagnostics', made_from, 'Robot', name)}\n{text}"


def _settings(aggregators: Sequence[ForeignAggregator], report: Report) -> Iterator[Row]:
    rate = _agreed([aggregator.rate for aggregator in aggregators if aggregator.rate], "pub_rate", report)
    base = _agreed([aggregator.base for aggregator in aggregators if aggregator.base], "base path", report)
    other = _agreed([item.other_is_error for item in aggregators if item.other_is_error], "other_as_errors", report)
    if rate:
        yield row(1, f"rate: {quantity(rate.value, 'Hz')}", f"{place(rate.span)}: pub_rate")
    if base and _path(base.value):
        yield row(1, f"base: {word(_path(base.value))}", place(base.span))
    if other and other.value:
        yield row(1, "other: error", f"{place(other.span)}: other_as_errors")


def _path(written: str) -> str:
    """Return a path with single slashes between its steps and none around them."""
    return "/".join(step for step in written.split("/") if step.strip())


def _agreed(given: Sequence[Given[T]], what: str, report: Report) -> Given[T] | None:
    """Return what all files say; of two things, the first."""
    for one in given[1:]:
        if one != given[0]:
            words = f"'{what}' was something else before; the first one counts"
            report.add(DISAGREES.at(one.span, words, related=[Related(given[0].span, "the first one")]))
    return given[0] if given else None


def _diagnostics_analyzers(analyzers: Sequence[ForeignAnalyzer], depth: int) -> Iterator[Row]:
    names = FreeNames()
    for analyzer in analyzers:
        name = names.take(analyzer.name, "group")
        was = f"; its name was '{plain(analyzer.name, 60)}'" if name != analyzer.name else ""
        yield row(depth, f"{name}:", f"{place(analyzer.span)}{was}")
        yield from _diagnostics_analyzer(analyzer, name, depth + 1)


def _diagnostics_analyzer(analyzer: ForeignAnalyzer, name: str, depth: int) -> Iterator[Row]:
    yield row(depth, f"type: {analyzer.type}")
    path = _path(analyzer.path.value) if analyzer.path else ""
    if analyzer.path and path != name and analyzer.type in ("generic", "group"):
        yield row(depth, f"path: {word(path)}", place(analyzer.path.span))
    conditions = [_condition(key, each) for key, ones in analyzer.matched.items() for each in ones]
    conditions += [(_EVERYTHING, each) for each in analyzer.stripped if not each.value]
    yield from _list("match", conditions, depth)
    yield from _list("expected", [(word(each.value), each) for each in analyzer.expected], depth)
    for key, prefixes in (("strip_prefix", analyzer.stripped), ("remove_prefix", analyzer.removed)):
        yield from _list(key, [(word(each.value), each) for each in prefixes if each.value], depth)
    if analyzer.timeout:
        never = ": never" if analyzer.timeout.value <= 0 else ""
        yield row(
            depth,
            f"timeout: {quantity(max(0.0, analyzer.timeout.value), 's')}",
            f"{place(analyzer.timeout.span)}{never}",
        )
    if analyzer.count and analyzer.count.value >= 0:
        yield row(depth, f"count: {analyzer.count.value}", f"{place(analyzer.count.span)}: num_items")
    if analyzer.discards:
        yield row(depth, f"discard_stale: {flag(analyzer.discards.value)}", place(analyzer.discards.span))
    if analyzer.below:
        yield row(depth, "analyzers:")
        yield from _diagnostics_analyzers(analyzer.below, depth + 1)


def _condition(key: str, given: Given[str]) -> tuple[str, Given[str]]:
    if not given.value and key in ("startswith", "contains"):
        return _EVERYTHING, given
    return flow({key: word(given.value)}), given


def _list(key: str, items: Sequence[tuple[str, Given[str]]], depth: int) -> Iterator[Row]:
    """Yield a list, in one line if it is short."""
    if not items:
        return
    text = f"{key}: {flow_list([text for text, _ in items])}"
    if len(items) == 1 or len({given.span.line for _, given in items}) == 1:
        line = row(depth, text, place(items[0][1].span))
        if len(line.text) <= WIDEST:
            yield line
            return
    yield row(depth, f"{key}:")
    for one, given in items:
        yield row(depth + 1, f"- {one}", place(given.span))
