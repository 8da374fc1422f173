"""Files of diagnostic_aggregator as they are read: analyzers with what they match, groups with analyzers below."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import field

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Report, Severity, Span, kind
from rbxcompose.importing.foreign_files import ForeignFile, ForeignMap, Given, maps_in
from rbxcompose.importing.importer import NOT_CARRIED_OVER, OTHER_PROGRAM
from rbxcompose.importing.ros_parameters import NodeParameters, parameters_with
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode
from rbxcompose.printable import plain

REFUSED = kind("RBX2296", Severity.WARNING)
NO_REGEX = kind("RBX2297")

TYPES = {
    "GenericAnalyzer": "generic",
    "AnalyzerGroup": "group",
    "IgnoreAnalyzer": "ignore",
    "DiscardAnalyzer": "discard",
}
MATCHERS = ("startswith", "contains", "name", "regex")
_BELOW = ("analyzers", "analyzers_params")
_MOST = 1_000_000  # items
_ELSEWHERE = {
    "critical": "with 'profile: modern' each change of a level is published at once",
    "history_depth": "'rbxcompose record' keeps changes of levels",
    "bond_id": "analyzers are tied to no other program",
}


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
    """Return the aggregators of a file; other nodes in it are told, and so is a file without any."""
    found, others = parameters_with(file, lambda root: bool(_analyzers(root)))
    if not found:
        words = f"'{plain(file.name)}' is no file of diagnostic_aggregator: nothing in it has the type of an analyzer"
        report.add(OTHER_PROGRAM.at(file.root.span, words))
        return []
    for node in others:
        words = f"'{plain(node.node, 60)}' is not carried over: it has no analyzers"
        report.add(NOT_CARRIED_OVER.at(node.span, words))
    return [_aggregator(node, report) for node in found]


def _analyzers(node: MappingNode) -> dict[str, Entry]:
    """Return the analyzers of an aggregator or of a group, by their names."""
    found = {name: one for name, one in node.entries.items() if name not in _BELOW and _has_type(one)}
    for key in _BELOW:
        if isinstance(below := node.get(key), MappingNode):
            found.update(below.entries)
    return found


def _has_type(one: Entry) -> bool:
    type_ = one.value.get("type") if isinstance(one.value, MappingNode) else None
    return isinstance(type_, ScalarNode) and "Analyzer" in type_.text


def _aggregator(node: NodeParameters, report: Report) -> ForeignAggregator:
    root = node.root
    analyzers = _analyzers(root)
    others = {name: one for name, one in root.entries.items() if name not in (*_BELOW, *analyzers)}
    told = ForeignMap(MappingNode(others, root.span), f"'{plain(node.node, 60)}'", node.span, report)
    base = told.text("base_path")
    other = told.text("path")
    found = ForeignAggregator(node.span, told.above_zero("pub_rate"), base or other, told.flag("other_as_errors"))
    told.flag("use_sim_time")
    for key, span in told.places(*_ELSEWHERE).items():
        report.add(NOT_CARRIED_OVER.at(span, f"'{key}' is not carried over: {_ELSEWHERE[key]}"))
    told.tell_others()
    found.analyzers = list(_read(analyzers, report))
    return found


def _read(analyzers: dict[str, Entry], report: Report) -> Iterator[ForeignAnalyzer]:
    for name, told in maps_in(MappingNode(analyzers), "analyzer", report):
        if (found := _analyzer(name, told)) is not None:
            yield found


def _analyzer(name: str, told: ForeignMap) -> ForeignAnalyzer | None:
    """Return an analyzer; None after the finding that says why it is left out."""
    type_ = _type(told)
    if type_ is None:
        return None
    one = ForeignAnalyzer(name, told.span, type_, told.text("path"))
    for key in MATCHERS:
        one.matched[key] = [each for each in _texts(told, key) if key != "regex" or _is_regex(each, told)]
    one.expected, one.stripped = _texts(told, "expected"), _texts(told, "find_and_remove_prefix")
    for key, span in told.places("remove_prefix").items():
        words = f"'{key}' of {told.what} is not carried over: 'find_and_remove_prefix' strips what it matches"
        told.tell(NOT_CARRIED_OVER.at(span, words))
    one.timeout, one.discards = told.number("timeout"), told.flag("discard_stale")
    one.count = told.whole("num_items", -1, _MOST)
    below = _analyzers(told.node) if type_ == "group" else {}
    told.places(*_BELOW, *below)
    told.tell_others()
    one.below = list(_read(below, told.report))
    if type_ == "ignore":
        words = f"{told.what} is not carried over: it matches nothing in ROS either, so its items are in Other"
        told.tell(NOT_CARRIED_OVER.at(told.span, words))
        return None
    why = _why_refused(one)
    if why:
        told.tell(REFUSED.at(told.span, f"{told.what} is left out: {why}"))
        return None
    return one


def _type(told: ForeignMap) -> str | None:
    given = told.text("type")
    if given is None:
        told.tell(REFUSED.at(told.span, f"{told.what} is left out: it has no type"))
        return None
    name = given.value.rpartition("/")[2].rpartition(":")[2]
    if name not in TYPES:
        words = f"{told.what} is not carried over: '{plain(given.value, 60)}' is an analyzer of another package"
        told.tell(NOT_CARRIED_OVER.at(given.span, words))
        return None
    return TYPES[name]


def _why_refused(one: ForeignAnalyzer) -> str:
    """Return why the aggregator refuses an analyzer; empty if it does not."""
    if one.type == "discard":
        return "" if _matches(one) else "it matches nothing"
    if one.path is None:
        return "it has no path"
    if one.type == "generic" and not _matches(one):
        return "it matches nothing"
    return "no analyzer is below it" if one.type == "group" and not one.below else ""


def _matches(one: ForeignAnalyzer) -> bool:
    return bool(any(one.matched.values()) or one.expected or one.stripped)


def _texts(told: ForeignMap, key: str) -> list[Given[str]]:
    """Return a text, or the texts of a list."""
    if isinstance(told.node.get(key), SequenceNode):
        return told.texts(key)
    found = told.text(key)
    return [] if found is None else [found]


def _is_regex(given: Given[str], told: ForeignMap) -> bool:
    try:
        re.compile(given.value)
    except (re.error, RecursionError, OverflowError) as error:
        told.tell(NO_REGEX.at(given.span, f"'regex' of {told.what} is left out: {error}"))
        return False
    return True
