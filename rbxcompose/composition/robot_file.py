"""Read a robot's file from text to `RobotManifest`, and any other manifest up to its checked header."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from rbxcompose.composition.includes import included_parts
from rbxcompose.composition.layers import INCLUDE, Chosen, Composed, compose_robot, profile_spans
from rbxcompose.composition.overlay import NOTHING_TO_CHANGE
from rbxcompose.composition.robot_manifest import RobotManifest
from rbxcompose.composition.scopes import fill_scopes
from rbxcompose.composition.section_reader import read_sections
from rbxcompose.composition.strayed_entries import without_strayed
from rbxcompose.composition.unread_arguments import unread_arguments
from rbxcompose.findings import Finding, Report, Span
from rbxcompose.manifest.documents import Documents
from rbxcompose.manifest.file_models import file_model
from rbxcompose.manifest.files import find, project_of, shown_name
from rbxcompose.manifest.fill import fill
from rbxcompose.manifest.fill_names import names_of
from rbxcompose.manifest.garbage_collection import paused_collection
from rbxcompose.manifest.header import ManifestHeader
from rbxcompose.manifest.mission_data import is_moderate
from rbxcompose.manifest.registry import sections
from rbxcompose.manifest.secrets import Secrets
from rbxcompose.manifest.section import ROBOT
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode
from rbxcompose.manifest.validate import MISSING_KEY
from rbxcompose.manifest.walk import TWICE

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
    root = documents.meant(file_model(ROBOT), root)
    composed = compose_robot(root, file, Chosen(profiles, overlays, sets), documents)
    manifest = _manifest(composed, file, sim, environment or {}, documents)
    if manifest is not None:
        named = (find(one) for one in overlays)
        shown = tuple(shown_name(one) for one in named if not isinstance(one, Finding))
        manifest = replace(manifest, profiles=profile_spans(root), overlays=shown)
    if not (report.has_errors or profiles):  # a misspelt name may be the one that is not read; a profile may replace it
        for one in (root, *composed.parts.roots):
            report.extend(unread_arguments(one))
    report.findings = composed.parts.inclusions.told(report.findings)
    return manifest


def _manifest(
    composed: Composed, file: Path, sim: bool, environment: Mapping[str, str], documents: Documents
) -> RobotManifest | None:
    keys = file_model(ROBOT)
    documents.check(keys, without_strayed(composed.root, keys.model_fields, documents.report))
    names = names_of(_name(composed.root), sim, environment, Secrets(project_of(file), environment))
    filled = fill_scopes(composed, names)
    read_so_far = len(documents.report.findings)
    is_whole = composed.parts.is_complete and not _has_a_section_twice(documents.report, composed.root)
    manifest = read_sections(filled.root, file, sim, documents, is_whole=is_whole)
    if not is_whole:
        _drop_what_may_be_there(documents.report, filled.root, filled.include, read_so_far)
    return replace(
        manifest,
        parts=included_parts(composed.instances),
        include=filled.include,
        bounds=filled.bounds,
        history=composed.history,
        files=documents.files,
        inclusions=composed.parts.inclusions,
    )


def _has_a_section_twice(report: Report, root: MappingNode) -> bool:
    """Return whether a file has a section with names twice, so that what stands in the second one is not read."""
    words = {entry.key.span for entry in root.entries.values() if isinstance(entry.value, ScalarNode)}
    twice = (one for one in report.findings if one.code == TWICE.code and one.span is not None and one.span.column == 1)
    return any(words.isdisjoint(other.span for other in one.related) for one in twice)


def _drop_what_may_be_there(report: Report, root: MappingNode, given: MappingNode, start: int) -> None:
    """Remove the findings about entries that may only change what could not be read: what a part brings, for example.

    `start` is the number of findings from before the sections were read.
    """
    prefixes = tuple(f"{name}_" for name, _ in _entries(given, INCLUDE))
    changing = [
        entry
        for section in sections(ROBOT)
        for name, entry in _entries(root, section.name)
        if section.has_topics or name.startswith(prefixes) or not prefixes
    ]
    spans = [span for one in changing for span in (one.key.span, one.value.span)]

    def stays(one: Finding) -> bool:
        return one.code != MISSING_KEY.code or not any(one.span and span.contains(one.span) for span in spans)

    before, after = report.findings[:start], report.findings[start:]
    report.findings = [*(one for one in before if one.code != NOTHING_TO_CHANGE.code), *filter(stays, after)]


def _entries(root: MappingNode, section: str) -> Iterable[tuple[str, Entry]]:
    there = root.get(section)
    return there.entries.items() if isinstance(there, MappingNode) else ()


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
    header = {name: entry for name, entry in root.entries.items() if name in ManifestHeader.model_fields}
    documents.check(ManifestHeader, replace(root, entries=header))
    filled = fill(root, names_of(robot, sim, environment or {}), report, runs=True)
    return filled if is_moderate(filled.get("data"), "datum", report) else None


def _name(root: MappingNode) -> str:
    name = root.get("name")
    return name.text if isinstance(name, ScalarNode) else ""
