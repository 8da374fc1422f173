"""A robot's file from text to `RobotManifest`, section by section; each reference is filled in within its own scope."""

import re
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rbxcompose.base.config import ARGUMENT, COMPONENT, Secret
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.types import UNKNOWN
from rbxcompose.base.findings import Finding, Related, Report, Severity, Span, kind, nearest
from rbxcompose.base.garbage_collection import paused_collection
from rbxcompose.compiler.composition.includes import PartInstance, included_parts
from rbxcompose.compiler.composition.layers import Chosen, Composed, compose_robot, profile_keys, profile_spans
from rbxcompose.compiler.composition.robot_manifest import (
    ROBOT_LAYER,
    History,
    RobotManifest,
    ScopedBounds,
    bounds_of,
    own_bounds,
)
from rbxcompose.compiler.doubts import has_a_section_twice, without_half_entries
from rbxcompose.compiler.sections.bus import foresee, msgs
from rbxcompose.compiler.sections.composition import args
from rbxcompose.manifest import registry
from rbxcompose.manifest.arguments import DeclaredArgument
from rbxcompose.manifest.documents import Documents, ManifestHeader
from rbxcompose.manifest.files import find, project_of, shown_name
from rbxcompose.manifest.fill import SHOWN_SECRET, Names, Secrets, Typed, fill, names_of, with_arguments
from rbxcompose.manifest.registry import sections_in_use
from rbxcompose.manifest.section import ROBOT, Contents, Section
from rbxcompose.manifest.tree import (
    BROKEN,
    MappingNode,
    ScalarNode,
    all_nodes,
    at,
    entries_of,
    is_empty,
    key_span,
    only,
    text_at,
    without,
)
from rbxcompose.manifest.validate import UNKNOWN_KEY
from rbxcompose.manifest.yaml_nodes import is_moderate
from rbxcompose.msgs import registry as types

NO_VALUE = kind("RBX1206")


@dataclass(frozen=True, slots=True)
class FilledScopes:
    """The robot's sections and its `include:` with every `${...}` filled in.

    `bounds` are those of arguments, by scope and name.
    """

    root: MappingNode
    include: MappingNode
    bounds: ScopedBounds


def fill_scopes(composed: Composed, names: Names) -> FilledScopes:
    """Fill in every `${...}` of a robot.

    The arguments' own values come first: those of the robot, then those of each instance, which are given in the scope
    of the file that includes it.
    """
    root, parts = composed.root, composed.parts
    report = parts.documents.report
    arguments = fill(only(root, args.name), names, report)
    declared = Contents(arguments, parts.robot, parts.documents).of(args)
    values = {name: _own_value(name, argument, composed.history, report) for name, argument in declared.items()}
    bounds = {"": {name: own_bounds(name, one, "the robot") for name, (one, _) in declared.items()}}
    whole = Contents(root, parts.robot, parts.documents, sections_in_use(ROBOT))
    may_have = (lambda name: whole.may_have(ARGUMENT, name)) if whole.stray or args.is_unreadable(root) else None
    names = with_arguments(names, values, "", may_have)
    include = fill(composed.include, names, report)
    for instance in reversed(composed.instances):  # an instance follows those that it includes
        declared = Contents(fill(instance.arguments, names, report), parts.robot, parts.documents).of(args)
        bounds[instance.name] = {
            name: own_bounds(name, one, f"the part '{instance.name}'") + bounds_of(instance.given.get(name), bounds)
            for name, (one, _) in declared.items()
        }
        may_have = (lambda name: True) if args.is_unreadable(instance.arguments) else None
        names = with_arguments(names, _given_values(instance, declared, names, report), instance.name, may_have)
    running = {section.name: section.running for section in sections_in_use(ROBOT) if section.running}
    filled = {**arguments.entries, **fill(without(root, args.name), names, report, running=running).entries}
    return FilledScopes(replace(root, entries={name: filled[name] for name in root.entries}), include, bounds)


def _own_value(name: str, declared: tuple[DeclaredArgument | None, Span], history: History, report: Report) -> Typed:
    argument, span = declared
    if argument is None:
        return Typed(UNKNOWN, BROKEN)
    if argument.default is None:
        message = f"the argument '{name}' has no value"
        report.add(NO_VALUE.at(span, message, help=f"give it a 'default:', or --set args.{name}=VALUE"))
        return Typed(argument.type, BROKEN)
    is_given = history.layer(("args", name, "default")) != ROBOT_LAYER
    return Typed(argument.type, argument.read(argument.default, report), argument.default.span if is_given else None)


def _given_values(
    instance: PartInstance, declared: Mapping[str, tuple[DeclaredArgument | None, Span]], names: Names, report: Report
) -> dict[str, Typed]:
    """Return the values of a part's arguments: those given by `with:`, else their defaults."""
    given = fill(instance.given, names, report)
    for name, entry in given.entries.items():
        if name not in declared:
            message = f"part '{instance.name}' has no argument '{name}'"
            finding = UNKNOWN_KEY.misspelt(
                entry.key.span, message, name, declared, "its arguments", taken=given.entries
            )
            report.add(finding)
    unknown = given.entries.keys() - declared.keys()  # then any other argument may be what was meant
    meant = {near for name in unknown for near in nearest(name, declared)}
    values: dict[str, Typed] = {}
    for name, (argument, span) in declared.items():
        node = given.get(name) or (argument.default if argument else None)
        if argument is None:
            values[name] = Typed(UNKNOWN, BROKEN)
        elif (node is not None and unknown and name not in given) or (node is None and name in meant):
            values[name] = Typed(argument.type, BROKEN)
        elif node is None:
            message = f"part '{instance.name}' needs a value for its argument '{name}'"
            related = [Related(span, "declared here")]
            help_text = f"give it one: 'with: {{{name}: ...}}'"
            report.add(NO_VALUE.at(instance.span, message, help=help_text, related=related))
            values[name] = Typed(argument.type, BROKEN)
        else:
            values[name] = Typed(argument.type, argument.read(node, report), node.span if name in given else None)
    return values


def without_strayed(root: MappingNode, keys: Container[str], report: Report) -> MappingNode:
    """Return a tree without keys that are the names of entries of its sections, after a finding for each."""
    left, in_use = dict(root.entries), registry.sections_in_use(ROBOT)
    empty = [each for each in in_use if each.names and (node := root.get(each.name)) and is_empty(node)]
    for name, entry in root.entries.items():
        home = next((each for each in in_use if name not in keys and name in each.names_in(root)), None)
        if name not in keys and home is None and len(empty) == 1 and isinstance(entry.value, MappingNode):
            home = empty[0]
        if home and isinstance(entry.value, MappingNode):
            del left[name]
            message = f"'{name}' is {_with_article(home.entry)}, not a section of the file"
            above = ".".join((home.name, *map(str, home.at)))
            report.add(UNKNOWN_KEY.at(entry.key.span, message, help=f"write it below '{above}:', one level deeper"))
    return replace(root, entries=left)


def _with_article(word: str) -> str:
    return f"{'an' if word[:1] in 'aeiou' else 'a'} {word}"


UNREAD_ARGUMENT = kind("RBX1209", Severity.WARNING)
_NAME = re.compile(r"\bargs\.([a-z][a-z0-9_]*)")


def unread_arguments(root: MappingNode) -> Iterator[Finding]:
    """Yield a finding for each argument of a robot's or part's file that no other text of it has."""
    declared = root.get("args")
    if not isinstance(declared, MappingNode):
        return
    texts = (node.text for node in all_nodes(root) if isinstance(node, ScalarNode) and "args." in node.text)
    read = {name for text in texts for name in _NAME.findall(text)}
    for name, entry in declared.entries.items():
        if name not in read and isinstance(entry.value, MappingNode):
            help_text = f"write '${{args.{name}}}' where its value belongs, or remove it"
            yield UNREAD_ARGUMENT.at(entry.key.span, f"nothing reads the argument '{name}'", help=help_text)


TAKEN_NAME = kind("RBX1007")
ALWAYS_THERE = ("transforms", "mission")
"""Components that every robot runs, beside `diagnostics`."""

RESERVED = ("buses", "actuators", "joints", "controllers", "safety", "devices", "console", "security", "record")
"""Names of sections that are reserved for later."""


def read_sections(
    root: MappingNode, file: Path, sim: bool, documents: Documents, *, is_whole: bool = True
) -> RobotManifest:
    """Return the robot that a composed and filled tree describes, with what could be read of entries with mistakes.

    The tree is not whole if one of the robot's parts could not be read.
    """
    documents.report.extend([*registry.broken_sections(), *_shown_secrets(root)])
    contents = Contents(
        root,
        file,
        documents,
        registry.sections_in_use(),
        others=registry.sections,
        named=registry.section_named,
        is_simulated=sim,
        is_whole=is_whole,
    )
    types.choose(contents.of(msgs))  # before anything that may name a type is read
    documents.report.extend(_taken_names(contents))
    for section in registry.sections_in_use(ROBOT):
        if section.is_composed:
            contents.of(section)
    name, about = text_at(root.get("name")), text_at(root.get("about"))
    return RobotManifest(name=name, about=about, path=file, root=root, is_simulated=sim, contents=contents)


def _shown_secrets(root: MappingNode) -> Iterator[Finding]:
    """Yield a finding for each secret in the header; the header was checked before anything was filled in."""
    for key in ManifestHeader.model_fields:
        value = root.get(key)
        if isinstance(value, ScalarNode) and isinstance(value.filled, Secret):
            yield SHOWN_SECRET.at(value.span, f"'{key}' cannot hold a secret: everybody sees it")


def _taken_names(contents: Contents) -> Iterator[Finding]:
    """Yield a finding for each name of something that runs that is already taken."""
    root = contents.root
    running = list(registry.naming_in_use(COMPONENT))
    for index, section in enumerate(running):
        for name in () if section.has_topics else _placed_names(contents, section):
            span = key_span(root, (section.name, *section.at, name))
            if message := _own_name(name, section):
                yield TAKEN_NAME.at(span, message)
            elif found := _other_owner(root, name, section, running[index + 1 :]):
                message, label, other = found
                yield TAKEN_NAME.at(span, message, related=[Related(key_span(root, other), label)])


def _placed_names(contents: Contents, section: Section[Any, Any]) -> Iterator[str]:
    """Yield the names in a section, but not those of sections that were indented too far."""
    named = at(contents.root, (section.name, *section.at))
    for name, entry in entries_of(named).items():
        if not contents.is_misplaced(section, entry):
            yield name


def is_own_name(name: str) -> bool:
    """Return whether a robot itself has this name: a section, or a component that every robot runs."""
    section = registry.section_named(name)
    return name in (*RESERVED, *ALWAYS_THERE) or (section is not None and ROBOT in section.files)


def _own_name(name: str, section: Section[Any, Any]) -> str:
    """Return why a user must not use a name, or nothing."""
    if name in ALWAYS_THERE:
        return f"every robot already runs a component '{name}'"
    return f"a {section.entry} cannot be named like the section '{name}'" if is_own_name(name) else ""


def _other_owner(
    root: MappingNode, name: str, section: Section[Any, Any], others: list[Section[Any, Any]]
) -> tuple[str, str, tuple[str, ...]] | None:
    """Return the other owner of a name: a message, a label, and its path."""
    for one in registry.sections_in_use(ROBOT):
        if name in one.brings and one.name in root:
            return f"the {one.name} already brings a component '{name}'", f"the {one.name}", (one.name,)
    for other in others:
        if name in other.names_in(root):
            words = f"a {section.entry} and a {other.entry} are both named '{name}'"
            return words, f"the {other.entry}", (other.name, *map(str, other.at), name)
    return None


MISSION = "Mission"


@paused_collection()
def load_robot(
    path: str | Path,
    *,
    report: Report,
    sources: dict[str, str],
    profiles: Sequence[str] = (),
    overlays: Sequence[str] = (),
    sets: Sequence[str] = (),
    sim: bool = True,
    environment: Mapping[str, str] | None = None,
) -> RobotManifest | None:
    """Read a robot's file with its parts, profiles, overlays and `--set` changes; mistakes go into `report`.

    Returns None if there is no usable robot, or one of its parts cannot be read; a robot with mistakes is returned as
    far as it could be read.
    """
    file = find(str(path))
    if isinstance(file, Finding):
        report.add(file)
        return None
    documents = Documents(report, sources)
    root = documents.read(file, ROBOT)
    if root is None:
        return None
    types.choose({})
    foresee(root, file)
    root = documents.meant(registry.model_for(ROBOT, root), root)
    composed = compose_robot(root, file, Chosen(profiles, overlays, sets), documents)
    manifest = _manifest(composed, file, sim, environment or {}, documents)
    if manifest is not None:
        named = (find(overlay) for overlay in overlays)
        shown = tuple(shown_name(item) for item in named if not isinstance(item, Finding))
        manifest = replace(manifest, profiles=profile_spans(root), profile_keys=profile_keys(root), overlays=shown)
    if not (report.has_errors or profiles):  # a misspelt name may be the one that is not read; a profile may replace it
        for node in (root, *composed.parts.roots):
            report.extend(unread_arguments(node))
    report.findings = composed.parts.inclusions.located(report.findings)
    return manifest


def _manifest(
    composed: Composed, file: Path, sim: bool, environment: Mapping[str, str], documents: Documents
) -> RobotManifest | None:
    keys = registry.model_for(ROBOT, composed.root)
    documents.check(keys, without_strayed(composed.root, keys.model_fields, documents.report))
    names = names_of(text_at(composed.root.get("name")), sim, environment, Secrets(project_of(file), environment))
    filled = fill_scopes(composed, names)
    report = documents.report
    read_so_far = len(report.findings)
    is_whole = composed.parts.is_complete and not has_a_section_twice(report, composed.root)
    manifest = read_sections(filled.root, file, sim, documents, is_whole=is_whole)
    if not is_whole:
        report.findings = without_half_entries(report.findings, read_so_far, filled.root, filled.include)
    return replace(
        manifest,
        parts=included_parts(composed.instances),
        include=filled.include,
        bounds=filled.bounds,
        history=composed.history,
        files=documents.files,
        inclusions=composed.parts.inclusions,
    )


@paused_collection()
def read_mission(
    path: Path,
    *,
    robot: str,
    report: Report,
    sources: dict[str, str],
    sim: bool = True,
    environment: Mapping[str, str] | None = None,
    span: Span | None = None,
) -> MappingNode | None:
    """Read a mission's file, check its header and fill in `${...}`; its body stays as nodes.

    `span` is the place that names the file.
    """
    documents = Documents(report, sources)
    root = documents.read(path, MISSION, span)
    if root is None:
        return None
    documents.check(ManifestHeader, only(root, *ManifestHeader.model_fields))
    filled = fill(root, names_of(robot, sim, environment or {}), report, runs=True)
    return filled if is_moderate(filled.get("data"), "datum", report) else None
