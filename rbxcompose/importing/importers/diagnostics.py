"""`diagnostics`: files of diagnostic_aggregator, for ROS 1 and ROS 2."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeVar

from rbxcompose.findings import Related, Report
from rbxcompose.importing.analyzer_files import ForeignAggregator, ForeignAnalyzer, read_aggregators
from rbxcompose.importing.foreign_files import ForeignFile, Given
from rbxcompose.importing.importer import DISAGREES, importer
from rbxcompose.importing.manifest_text import (
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
from rbxcompose.importing.names import FreeNames
from rbxcompose.printable import plain

T = TypeVar("T")

_EVERYTHING = "{regex: '.*'}"  # what an empty beginning matches


@importer("diagnostics", "analyzers of diagnostic_aggregator, for ROS 1 and ROS 2")
def diagnostics(files: Sequence[ForeignFile], name: str, report: Report) -> str:
    """Return a robot with the analyzers of the files, which follow the rules of the aggregator to the letter."""
    found = {file.name: read_aggregators(file, report) for file in files}
    aggregators = [one for ones in found.values() for one in ones]
    rows = list(_analyzers([one for each in aggregators for one in each.analyzers], 2))
    if not rows:
        return ""
    made_from = [file for file, ones in found.items() if ones]
    head = [row(0, "diagnostics:"), row(1, "profile: ros1", "the rules of diagnostic_aggregator, to the letter")]
    text = section([*head, *_settings(aggregators, report), row(1, "analyzers:"), *rows])
    return f"{header('diagnostics', made_from, 'Robot', name)}\n{text}"


def _settings(aggregators: Sequence[ForeignAggregator], report: Report) -> Iterator[Row]:
    rate = _agreed([one.rate for one in aggregators if one.rate], "pub_rate", report)
    base = _agreed([one.base for one in aggregators if one.base], "base path", report)
    other = _agreed([one.other_is_error for one in aggregators if one.other_is_error], "other_as_errors", report)
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


def _analyzers(analyzers: Sequence[ForeignAnalyzer], depth: int) -> Iterator[Row]:
    names = FreeNames()
    for one in analyzers:
        name = names.take(one.name, "group")
        was = f"; its name was '{plain(one.name, 60)}'" if name != one.name else ""
        yield row(depth, f"{name}:", f"{place(one.span)}{was}")
        yield from _analyzer(one, name, depth + 1)


def _analyzer(one: ForeignAnalyzer, name: str, depth: int) -> Iterator[Row]:
    yield row(depth, f"type: {one.type}")
    path = _path(one.path.value) if one.path else ""
    if one.path and path != name and one.type in ("generic", "group"):
        yield row(depth, f"path: {word(path)}", place(one.path.span))
    conditions = [_condition(key, each) for key, ones in one.matched.items() for each in ones]
    yield from _list("match", conditions, depth)
    yield from _list("expected", [(word(each.value), each) for each in one.expected], depth)
    yield from _list("strip_prefix", [(word(each.value), each) for each in one.stripped if each.value], depth)
    if one.timeout:
        never = ": never" if one.timeout.value <= 0 else ""
        yield row(depth, f"timeout: {quantity(max(0.0, one.timeout.value), 's')}", f"{place(one.timeout.span)}{never}")
    if one.count and one.count.value >= 0:
        yield row(depth, f"count: {one.count.value}", f"{place(one.count.span)}: num_items")
    if one.discards:
        yield row(depth, f"discard_stale: {flag(one.discards.value)}", place(one.discards.span))
    if one.below:
        yield row(depth, "analyzers:")
        yield from _analyzers(one.below, depth + 1)


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
