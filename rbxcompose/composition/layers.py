"""The layers of a robot, bottom to top: parts -> robot -> profiles -> overlays -> `--set`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from itertools import islice
from pathlib import Path

from rbxcompose.composition.history import ROBOT_LAYER, History, HistoryStep
from rbxcompose.composition.includes import PartInstance, Parts
from rbxcompose.composition.overlay import NOTHING_TO_CHANGE, compose, join, settled
from rbxcompose.composition.set_options import read_sets
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Report, Span
from rbxcompose.manifest.documents import Documents
from rbxcompose.manifest.file_models import file_model
from rbxcompose.manifest.files import PROFILE, find, shown_name
from rbxcompose.manifest.header import ManifestHeader
from rbxcompose.manifest.limits import KEYS
from rbxcompose.manifest.section import OVERLAY, Contents
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode, with_children
from rbxcompose.manifest.yaml_nodes import TOO_LARGE
from rbxcompose.printable import plain
from rbxcompose.sections.include import include
from rbxcompose.sections.profiles import profiles

INCLUDE = include.name


@dataclass(frozen=True, slots=True)
class Chosen:
    """The layers that a command puts over the robot's file: profiles by name, overlays by path, single values."""

    profiles: Sequence[str] = ()
    overlays: Sequence[str] = ()
    sets: Sequence[str] = ()


@dataclass(slots=True)
class Composed:
    """A robot with nothing filled in yet: its sections, its `include:`, and the instances of its parts."""

    root: MappingNode
    include: MappingNode
    instances: tuple[PartInstance, ...]
    parts: Parts
    history: History = field(default_factory=History)


def compose_robot(root: MappingNode, file: Path, chosen: Chosen, documents: Documents) -> Composed:
    """Return a robot's file with its parts below and the chosen layers on top."""
    report, history = documents.report, History()
    overlays = [*_profiles(root, file, chosen.profiles, documents), *_overlays(chosen.overlays, documents)]
    own = _without(root, profiles.name)
    included = _include(own, overlays, chosen.sets, history, documents)
    parts = Parts(documents, file)
    instances = tuple(parts.instances(included))
    own = _without(own, INCLUDE)
    if instances:
        brought = join([(one.root, one.name, one.span) for one in instances], report, history)
        composed = compose(replace(brought, span=root.span), [(own, ROBOT_LAYER)], report, history)
        order = dict.fromkeys((*own.entries, *composed.entries))  # the order of the robot's file
        composed = replace(composed, entries={name: composed.entries[name] for name in order if name in composed})
    else:
        composed = settled(own, report)
        for name, entry in composed.entries.items():
            history.write((name,), HistoryStep(ROBOT_LAYER, entry.value, entry.value.span))
    composed = compose(composed, [(_without(tree, INCLUDE), name) for tree, name in overlays], report, history)
    if chosen.sets:
        composed = compose(composed, read_sets(chosen.sets, composed, report, documents.sources), report, history)
    return Composed(_with_few_keys(composed, report), included, instances, parts, history)


def _with_few_keys(root: MappingNode, report: Report) -> MappingNode:
    """Return a tree whose maps have as few keys as that of one file may have: layers can bring more together."""

    def shortened(node: TreeNode) -> TreeNode:
        if isinstance(node, MappingNode) and len(node.entries) > KEYS:
            last = list(node.entries.values())[KEYS]
            report.add(TOO_LARGE.at(last.key.span, f"with this key, a map of the robot has more than {KEYS:,}"))
            node = replace(node, entries=dict(islice(node.entries.items(), KEYS)))
        return node if isinstance(node, ScalarNode) else with_children(node, lambda _, below: shortened(below))

    short = shortened(root)
    return short if isinstance(short, MappingNode) else root


def _include(
    root: MappingNode,
    overlays: list[tuple[MappingNode, str]],
    sets: Sequence[str],
    history: History,
    documents: Documents,
) -> MappingNode:
    """Return the section `include` after all layers: the parts it names are read before anything else is composed."""
    included = settled(only(root, INCLUDE), documents.report)
    for entry in included.entries.values():
        history.write((INCLUDE,), HistoryStep(ROBOT_LAYER, entry.value, entry.value.span))
    changes = [(only(tree, INCLUDE), name) for tree, name in overlays]
    included = compose(included, changes, documents.report, history)
    lines = read_sets(sets, included, documents.report, documents.sources, of_include=True)
    return compose(included, lines, documents.report, history)


def only(root: MappingNode, key: str) -> MappingNode:
    """Return a tree with only one of its keys."""
    return replace(root, entries={name: entry for name, entry in root.entries.items() if name == key})


def _without(root: MappingNode, key: str) -> MappingNode:
    return replace(root, entries={name: entry for name, entry in root.entries.items() if name != key})


def _profiles(
    root: MappingNode, file: Path, chosen: Sequence[str], documents: Documents
) -> Iterator[tuple[MappingNode, str]]:
    """Yield the chosen profiles, in the order of the command."""
    named = Contents(root, file, documents).of(profiles)
    if named is not None:
        for name, overlay in chosen_profiles(chosen, named, "robot", documents):
            yield overlay, f"profile '{name}'"


def chosen_profiles(
    chosen: Sequence[str], named: Mapping[str, Entry], what: str, documents: Documents
) -> Iterator[tuple[str, MappingNode]]:
    """Yield the chosen ones of the profiles that `what` has, a robot or a system; report those that it has not."""
    if chosen:
        documents.sources[PROFILE] = "\n".join(map(plain, chosen))
    for line, name in enumerate(chosen, 1):
        overlay = named[name].value if name in named else None
        if isinstance(overlay, MappingNode):
            yield name, overlay
        else:
            span = Span(PROFILE, line, 1, line, len(name) + 1)
            message = f"the {what} has no profile '{name}'"
            documents.report.add(NOTHING_TO_CHANGE.misspelt(span, message, name, named, "profiles"))


def profile_spans(root: MappingNode) -> dict[str, Span]:
    """Return the span of each profile in a robot's file, from its name to its end."""
    there = root.get(profiles.name)
    named = there.entries if isinstance(there, MappingNode) else {}
    return {
        name: one.key.span._replace(end_line=one.value.span.end_line, end_column=one.value.span.end_column)
        for name, one in named.items()
        if isinstance(one.value, MappingNode)
    }


def _overlays(chosen: Sequence[str], documents: Documents) -> Iterator[tuple[MappingNode, str]]:
    """Yield the files of `-f` without their headers, in the order of the command."""
    for written in chosen:
        file = find(written)
        if isinstance(file, Finding):
            documents.report.add(file)
        elif (root := documents.read(file, OVERLAY)) is not None:
            root = documents.meant(file_model(OVERLAY), root)
            documents.check(file_model(OVERLAY), root)
            sections = {name: entry for name, entry in root.entries.items() if name not in ManifestHeader.model_fields}
            yield replace(root, entries=sections), f"overlay '{shown_name(file)}'"
