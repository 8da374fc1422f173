"""The layers of a robot, one over the other: parts -> robot -> profiles -> overlays -> `--set`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from rbxcompose.config import Name
from rbxcompose.findings import Finding, Span
from rbxcompose.manifest.documents import Documents
from rbxcompose.manifest.files import find, shown_name
from rbxcompose.manifest.history import ROBOT_LAYER, History, Step
from rbxcompose.manifest.include import Instance, Parts
from rbxcompose.manifest.models import Header, OverlayFile
from rbxcompose.manifest.overlay import INCLUDE, NOTHING_TO_CHANGE, compose, join, read_sets, settled
from rbxcompose.manifest.tree import Entry, Mapping
from rbxcompose.manifest.validate import validate
from rbxcompose.plain import plain

OVERLAY = "Overlay"
PROFILE = "--profile"
PROFILES: Any = dict[Name, dict[str, Any]]


@dataclass(frozen=True, slots=True)
class Chosen:
    """What a command lays over the robot's file: profiles by name, overlays by path, single values."""

    profiles: Sequence[str] = ()
    overlays: Sequence[str] = ()
    sets: Sequence[str] = ()


@dataclass(slots=True)
class Composed:
    """A robot with nothing filled in yet: its sections, its `include:`, and the instances of its parts."""

    root: Mapping
    include: Mapping
    instances: tuple[Instance, ...]
    parts: Parts
    history: History = field(default_factory=History)


def compose_robot(root: Mapping, file: Path, chosen: Chosen, documents: Documents) -> Composed:
    """Return a robot's file with its parts below and what was chosen on top."""
    report, history = documents.report, History()
    overlays = [*_profiles(root, chosen.profiles, documents), *_overlays(chosen.overlays, documents)]
    own = _without(root, "profiles")
    include = _include(own, overlays, chosen.sets, history, documents)
    parts = Parts(documents, file)
    instances = tuple(parts.instances(include))
    own = _without(own, INCLUDE)
    if instances:
        brought = join([(one.root, one.name, one.span) for one in instances], report, history)
        composed = compose(replace(brought, span=root.span), [(own, ROBOT_LAYER)], report, history)
        order = dict.fromkeys((*own.entries, *composed.entries))  # as the robot's file has it
        composed = replace(composed, entries={name: composed.entries[name] for name in order if name in composed})
    else:
        composed = settled(own, report)
        for name, entry in composed.entries.items():
            history.write((name,), Step(ROBOT_LAYER, entry.value, entry.value.span))
    composed = compose(composed, [(_without(tree, INCLUDE), name) for tree, name in overlays], report, history)
    if chosen.sets:
        composed = compose(composed, read_sets(chosen.sets, composed, report, documents.sources), report, history)
    return Composed(composed, include, instances, parts, history)


def _include(
    root: Mapping, overlays: list[tuple[Mapping, str]], sets: Sequence[str], history: History, documents: Documents
) -> Mapping:
    """Return the section `include` as all layers have it: what it names is read before anything else is composed."""
    include = settled(only(root, INCLUDE), documents.report)
    for entry in include.entries.values():
        history.write((INCLUDE,), Step(ROBOT_LAYER, entry.value, entry.value.span))
    changes = [(only(tree, INCLUDE), name) for tree, name in overlays]
    include = compose(include, changes, documents.report, history)
    lines = read_sets(sets, include, documents.report, documents.sources, of_include=True)
    return compose(include, lines, documents.report, history)


def only(root: Mapping, key: str) -> Mapping:
    """Return a tree with nothing but one of its keys."""
    return replace(root, entries={name: entry for name, entry in root.entries.items() if name == key})


def _without(root: Mapping, key: str) -> Mapping:
    return replace(root, entries={name: entry for name, entry in root.entries.items() if name != key})


def _profiles(root: Mapping, chosen: Sequence[str], documents: Documents) -> Iterator[tuple[Mapping, str]]:
    """Yield the chosen profiles, in the order of the command."""
    report = documents.report
    there = root.get("profiles")
    is_read = there is None or validate(PROFILES, there, ("profiles",), report) is not None
    named: dict[str, Entry] = there.entries if isinstance(there, Mapping) and is_read else {}
    if chosen:
        documents.sources[PROFILE] = "\n".join(map(plain, chosen))
    for line, name in enumerate(chosen, 1):
        overlay = named[name].value if name in named else None
        if isinstance(overlay, Mapping):
            yield overlay, f"profile '{name}'"
        elif is_read:
            span = Span(PROFILE, line, 1, line, len(name) + 1)
            message = f"the robot has no profile '{name}'"
            report.add(NOTHING_TO_CHANGE.misspelt(span, message, name, named, "profiles"))


def profile_spans(root: Mapping) -> dict[str, Span]:
    """Return where each profile of a robot's file stands, from its name to its end."""
    there = root.get("profiles")
    named = there.entries if isinstance(there, Mapping) else {}
    return {
        name: one.key.span._replace(end_line=one.value.span.end_line, end_column=one.value.span.end_column)
        for name, one in named.items()
        if isinstance(one.value, Mapping)
    }


def _overlays(chosen: Sequence[str], documents: Documents) -> Iterator[tuple[Mapping, str]]:
    """Yield the files of `-f`, in the order of the command; the header is their own."""
    for written in chosen:
        file = find(written)
        if isinstance(file, Finding):
            documents.report.add(file)
        elif (root := documents.read(file, OVERLAY)) is not None:
            documents.check(OverlayFile, root)
            sections = {name: entry for name, entry in root.entries.items() if name not in Header.model_fields}
            yield replace(root, entries=sections), f"overlay '{shown_name(file)}'"
