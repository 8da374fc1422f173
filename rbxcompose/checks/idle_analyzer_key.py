"""A key of an analyzer that has no effect."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.diagnostics.settings import AnalyzerModel, each_analyzer
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot

_OF_ITEMS = ("match", "expected", "strip_prefix", "discard_stale", "count")
_OF_LEVELS = ("debounce", "latch", "suppressed_by")
_WITHOUT_EFFECT = {
    "generic": ("analyzers",),
    "group": (*_OF_ITEMS, "timeout"),
    "other": ("match", "expected", "strip_prefix", "discard_stale", "analyzers"),
    "ignore": ("timeout", "discard_stale", "count", "path", "analyzers", *_OF_LEVELS),
    "discard": ("timeout", "discard_stale", "count", "path", "analyzers", *_OF_LEVELS),
}


@check("RBX5010")
def idle_analyzer_key(robot: Robot) -> Iterator[Finding]:
    """A key of an analyzer has no effect."""
    is_ros1 = robot.manifest.diagnostics.profile == "ros1"
    for path, analyzer in each_analyzer(robot.manifest.diagnostics.analyzers):
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
