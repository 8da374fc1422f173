"""The layers of a robot, bottom to top: parts, robot, profiles, overlays, `--set`."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from itertools import islice
from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Report, Span, kind, suggest
from rbxcompose.base.printable import plain
from rbxcompose.compiler.composition.includes import PartInstance, Parts
from rbxcompose.compiler.composition.overlay import NOTHING_TO_CHANGE, SET, compose, is_removal, join, settled
from rbxcompose.compiler.composition.robot_manifest import ROBOT_LAYER, History, HistoryStep
from rbxcompose.compiler.sections.composition import include, profiles
from rbxcompose.manifest.documents import Documents, ManifestHeader
from rbxcompose.manifest.files import PROFILE, find, shown_name
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.registry import model_for, section_named, sections
from rbxcompose.manifest.section import OVERLAY, ROBOT, Contents, SetScope
from rbxcompose.manifest.tree import (
    KEYS,
    Entry,
    Key,
    MappingNode,
    ScalarNode,
    TreeNode,
    all_nodes,
    entries_of,
    only,
    with_children,
    without,
)
from rbxcompose.manifest.yaml_nodes import TOO_LARGE

BAD_SET = kind("RBX1303")

HEADER = ("about",)  # keys of the header that it may change


def read_sets(
    sets: Sequence[str], root: MappingNode, report: Report, sources: dict[str, str], *, of_include: bool = False
) -> list[tuple[MappingNode, str]]:
    """Return one overlay for each `PATH=VALUE`; together they are one source text, with a line for each.

    Those of `include` need a call of their own, since parts are read before all else is composed.
    """
    if sets:
        sources[SET] = "\n".join(text.replace("\n", " ") for text in sets)
    overlays = (
        _set_overlay(text.replace("\n", " "), line, root, report)
        for line, text in enumerate(sets, 1)
        if (text.partition("=")[0].strip().partition(".")[0] == include.name) is of_include
    )
    return [(overlay, f"'{SET}'") for overlay in overlays if overlay]


def _set_overlay(text: str, line: int, root: MappingNode, report: Report) -> MappingNode | None:
    written, equals, value_text = text.partition("=")
    span = Span(SET, line, 1, line, len(written) + 1)
    names = written.strip().split(".")
    if not equals or not all(names):
        meant = ".".join(filter(None, names))
        message = f"'{SET} {text}' is not a path and a value"
        report.add(BAD_SET.at(span, message, help=f"write {SET} {meant or 'PATH'}={value_text or 'VALUE'}"))
        return None
    path = _set_path(names, span, root, report)
    if path is None:
        return None
    value = _set_value(value_text, line, len(written) + 1, report)
    if value is None:
        return None
    section = section_named(path[0]) if len(path) == 2 else None
    if section and section.scope in (SetScope.KEYS, SetScope.BARE) and not is_removal(value):
        message = f"'{SET}' does not say what of '{path[1]}' to change"
        report.add(BAD_SET.at(span, message, help=f"write {SET} {path[1]}.KEY=VALUE"))
        return None
    for name in reversed(path):
        value = MappingNode({name: Entry(ScalarNode(name, span), value)}, span)
    return value if isinstance(value, MappingNode) else None


def _set_path(names: list[str], span: Span, root: MappingNode, report: Report) -> list[str] | None:
    """Return the path from the root; if it leads nowhere, report that and return None."""
    section = section_named(names[0]) if names[0] not in HEADER else None
    scope = section.scope if section else SetScope.NOTHING
    if names[0] in HEADER or (section and scope is not SetScope.NOTHING and not section.is_map):
        return names
    if section is None or scope is SetScope.NOTHING:
        section, rest = next(one for one in sections() if one.scope is SetScope.BARE), names
    else:
        rest = names[1:]
    there = list(section.names_in(root))
    if not rest or rest[0] not in there:
        message = f"'{SET}' changes '{'.'.join(names)}', which the robot does not have"
        choices = there if section.name == names[0] else [*there, *settable()]
        fix = in_section(names, root) or suggest(rest[0] if rest else "", choices, "a path starts with")
        report.add(NOTHING_TO_CHANGE.at(span, message, help=fix))
        return None
    return [section.name, *rest]


def settable() -> list[str]:
    """Return the words that may begin a path of `--set`, besides the names of components."""
    return [*HEADER, *(section.name for section in sections(ROBOT) if section.scope is not SetScope.NOTHING)]


def in_section(names: Sequence[str], root: MappingNode) -> str:
    """Return the help for a path that begins with an entry's name but lacks its section; else nothing."""
    for section in sections():
        if section.is_map and section.scope is not SetScope.NOTHING and names[0] in section.names_in(root):
            return f"did you mean '{section.name}.{'.'.join(names)}'?"
    return ""


def _set_value(text: str, line: int, column: int, report: Report) -> TreeNode | None:
    """Read the value of a `--set`; blank lines and columns before it give it the positions of the argument."""
    if not text.strip():
        return ScalarNode("", Span(SET, line, column, line, column + 1))
    node, findings = read_text("\n" * (line - 1) + " " * column + text, SET)
    report.extend(findings)
    return node


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
    own = without(root, profiles.name)
    included = _include(own, overlays, chosen.sets, history, documents)
    parts = Parts(documents, file)
    instances = tuple(parts.instances(included))
    own = without(own, INCLUDE)
    if instances:
        brought = join([(instance.root, instance.name, instance.span) for instance in instances], report, history)
        composed = compose(replace(brought, span=root.span), [(own, ROBOT_LAYER)], report, history)
        order = dict.fromkeys((*own.entries, *composed.entries))  # the order of the robot's file
        composed = replace(composed, entries={name: composed.entries[name] for name in order if name in composed})
    else:
        composed = settled(own, report)
        for name, entry in composed.entries.items():
            history.write((name,), HistoryStep(ROBOT_LAYER, entry.value, entry.value.span))
    composed = compose(composed, [(without(tree, INCLUDE), name) for tree, name in overlays], report, history)
    if chosen.sets:
        composed = compose(composed, read_sets(chosen.sets, composed, report, documents.sources), report, history)
    return Composed(_with_few_keys(composed, report), included, instances, parts, history)


def _with_few_keys(root: MappingNode, report: Report) -> MappingNode:
    """Return a tree whose maps have as few keys as that of one file may have: layers can bring more together."""

    def shortened(_: Key, node: TreeNode) -> TreeNode:
        if isinstance(node, MappingNode) and len(node.entries) > KEYS:
            last = list(node.entries.values())[KEYS]
            report.add(TOO_LARGE.at(last.key.span, f"with this key, a map of the robot has more than {KEYS:,}"))
            node = replace(node, entries=dict(islice(node.entries.items(), KEYS)))
        return node if isinstance(node, ScalarNode) else with_children(node, shortened)

    if not any(isinstance(node, MappingNode) and len(node.entries) > KEYS for node in all_nodes(root)):
        return root
    short = shortened("", root)
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


def profile_keys(root: MappingNode) -> dict[str, frozenset[str]]:
    """Return the names of the sections that each profile in a robot's file changes."""
    named = entries_of(root.get(profiles.name))
    return {name: frozenset(one.value.entries) for name, one in named.items() if isinstance(one.value, MappingNode)}


def profile_spans(root: MappingNode) -> dict[str, Span]:
    """Return the span of each profile in a robot's file, from its name to its end."""
    named = entries_of(root.get(profiles.name))
    return {
        name: entry.key.span._replace(end_line=entry.value.span.end_line, end_column=entry.value.span.end_column)
        for name, entry in named.items()
        if isinstance(entry.value, MappingNode)
    }


def _overlays(chosen: Sequence[str], documents: Documents) -> Iterator[tuple[MappingNode, str]]:
    """Yield the files of `-f` without their headers, in the order of the command."""
    for written in chosen:
        file = find(written)
        if isinstance(file, Finding):
            documents.report.add(file)
        elif (root := documents.read(file, OVERLAY)) is not None:
            root = documents.meant(model_for(OVERLAY, root), root)
            documents.check(model_for(OVERLAY, root), root)
            sections = {name: entry for name, entry in root.entries.items() if name not in ManifestHeader.model_fields}
            yield replace(root, entries=sections), f"overlay '{shown_name(file)}'"
