"""Which findings are withheld because they may only follow from another mistake, or from what a profile removes.

Where something has errors, or could not be read, rules must not report what may only follow from that. All is decided
by what findings carry: their codes, their places, and the names that they are about.
"""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import ALL, MISSIONS, NAMES, OWN, WIRING, Finding, Related, Severity, Span, kind
from rbxcompose.compiler.composition.overlay import NOTHING_TO_CHANGE
from rbxcompose.compiler.composition.robot_manifest import History, RobotManifest
from rbxcompose.compiler.sections.composition import include
from rbxcompose.manifest.documents import ManifestHeader
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.reader import TWICE
from rbxcompose.manifest.registry import section_named, sections_in_use
from rbxcompose.manifest.section import ROBOT, Section
from rbxcompose.manifest.shapes import refers_below
from rbxcompose.manifest.tree import BROKEN, KeyPath, MappingNode, ScalarNode, SequenceNode, TreeNode, at, entries_of
from rbxcompose.manifest.validate import MISSING_KEY

STILL_USED = kind("RBX1310")
_MOST_SHOWN = 8
ENTRY = 2  # length of the path of an entry: section and name
_WORD = re.compile(r"[A-Za-z_/.][\w/.]*")  # what may be the name of a component or of a topic


@dataclass(frozen=True, slots=True)
class Doubts:
    """What is in doubt: `about` are the worlds of rules, `files` those of missions.

    `places` are the values, by file and line; those of several lines by file and line 0.
    """

    about: frozenset[str] = frozenset()
    places: Mapping[tuple[str, int], Collection[Span]] = field(default_factory=dict)
    files: frozenset[str] = frozenset()

    def bar(self, closed: Iterable[str]) -> bool:
        """Return whether a rule must be silent that takes all of these for known."""
        wanted = {*closed}
        return bool(self.about if ALL in wanted else self.about & {*wanted, ALL} if wanted else ())

    def touch(self, finding: Finding, closed: Collection[str]) -> bool:
        """Return whether a finding rests on something in doubt."""
        spans = [span for span in (finding.span, *(one.span for one in finding.related)) if span]
        if OWN in closed and any(span.file in self.files for span in spans[:1]):
            return True
        near = ((span, (span.file, line)) for span in spans for line in (span.line, 0))
        return any(place.contains(span) for span, key in near for place in self.places.get(key, ()))


def doubts_of(manifest: RobotManifest, findings: Iterable[Finding]) -> Doubts:
    """Return what is in doubt after these findings."""
    errors = [finding for finding in findings if finding.severity is Severity.ERROR]
    if not errors:
        return Doubts()
    found = _Search(manifest, errors)
    about = {world for path, is_missing in found.paths for world in _worlds(manifest, path, is_missing)}
    about |= {world for section, name in _lost(manifest) for world in _worlds(manifest, (section.name, name), False)}
    files = {shown_name(mission.path): name for name, mission in manifest.missions.items()}
    elsewhere = {error.span.file if error.span else "" for error in errors if error.span not in found.seen}
    about |= {MISSIONS if file in files else _owner(manifest, file) for file in elsewhere}
    places = _by_line((*found.places, *found.wanted))
    return Doubts(frozenset(about), places, frozenset(elsewhere & files.keys()))


def _by_line(spans: Iterable[Span]) -> dict[tuple[str, int], list[Span]]:
    """Return spans by file and line, those of several lines by file and line 0."""
    found: dict[tuple[str, int], list[Span]] = {}
    for span in dict.fromkeys(spans):
        found.setdefault((span.file, span.line if span.line == span.end_line else 0), []).append(span)
    return found


def _owner(manifest: RobotManifest, file: str) -> str:
    """Return what errors in a file put in doubt that is none of the robot's manifests or missions."""
    if not file or file in manifest.files:
        return ALL
    return WIRING if "body" in manifest.root and not file.endswith((".yaml", ".yml")) else MISSIONS


class _Search:
    """Finds the errors in the composed tree: the paths of what they are about, and the values that are in doubt."""

    def __init__(self, manifest: RobotManifest, errors: Iterable[Finding]) -> None:
        self.wanted = {error.span: error.code == MISSING_KEY.code for error in errors if error.span}
        self.lines: dict[tuple[str, int], list[Span]] = {}
        for span in self.wanted:
            self.lines.setdefault((span.file, span.line), []).append(span)
        self.paths: list[tuple[KeyPath, bool]] = []
        self.places: list[Span] = []
        self.seen: set[Span | None] = set()
        self._walk(manifest.root, ())
        self._walk(manifest.include, ())
        left = self.wanted.keys() - self.seen
        for span in left:
            self._enclose(manifest.root, span)

    def _walk(self, node: TreeNode, path: KeyPath) -> None:
        match node:
            case MappingNode(entries=entries):
                for name, entry in entries.items():
                    below = (*path, name)
                    if entry.key.span in self.wanted:
                        self.seen.add(entry.key.span)
                        if entry.key.text == name:  # a misspelt key that was read as it was meant leaves no doubt
                            self._key(below, entry.key.span, entry.value.span)
                    self._walk(entry.value, below)
            case SequenceNode(items=items):
                for index, item in enumerate(items):
                    self._walk(item, (*path, index))
            case ScalarNode() if (node.span.file, node.span.line) in self.lines or node.filled is BROKEN:
                inside = [
                    span for span in self.lines.get((node.span.file, node.span.line), ()) if node.span.contains(span)
                ]
                if inside or node.filled is BROKEN:
                    self._add(path, node.span, inside)
                return
        if node.span in self.wanted and path:
            self._add(path, node.span, [node.span])

    def _key(self, path: KeyPath, key: Span, value: Span) -> None:
        is_missing = self.wanted[key]
        self.paths.append((path, is_missing))
        self.places += [key] if is_missing else [key, value]

    def _add(self, path: KeyPath, place: Span, errors: Iterable[Span]) -> None:
        self.seen.update(errors)
        self.paths.append((path, False))
        self.places.append(place)

    def _enclose(self, node: TreeNode, span: Span, path: KeyPath = ()) -> None:
        """Note an error that is at no key and no value, by the innermost entry around it."""
        for name, entry in entries_of(node).items():
            if entry.value.span.contains(span):
                self._enclose(entry.value, span, (*path, name))
                return
        if path:
            self._add(path, node.span, [span])


def _worlds(manifest: RobotManifest, path: KeyPath, is_missing: bool) -> Iterator[str]:
    """Yield what an error at a path puts in doubt."""
    section = section_named(path[0])
    if path[0] in ManifestHeader.model_fields:
        return
    if section is None:
        yield ALL
    elif not section.is_composed:
        yield from _above(manifest, path)
    elif not section.wires:
        yield section.name
    elif len(path) < ENTRY:
        yield from (WIRING, NAMES)
    elif not is_missing and not _is_plain(section, manifest, path):
        yield WIRING


def _above(manifest: RobotManifest, path: KeyPath) -> Iterator[str]:
    """Yield what an error in a section puts in doubt that only composition reads; a wrong argument is where it goes."""
    if len(path) < ENTRY or (path[0] == include.name and path[1] not in manifest.parts):
        yield ALL
    elif path[0] == include.name and path[ENTRY : ENTRY + 1] != ("with",):
        yield WIRING


def _is_plain(section: Section[Any, Any], manifest: RobotManifest, path: KeyPath) -> bool:
    """Return whether a value is no name of a component, a port or a topic, so that it changes no wire."""
    entry, value = at(manifest.root, path[:ENTRY]), at(manifest.root, path)
    if len(path) == ENTRY or entry is None:
        return False
    refers = [refers_below(hint, path[ENTRY:]) for hint in section.types_of(entry)]
    known = [flag for flag in refers if flag is not None]
    if not known:  # an unknown key may be a misspelt one
        return isinstance(value, ScalarNode) and not _WORD.fullmatch(value.text)
    return not any(known)


def _lost(manifest: RobotManifest) -> Iterator[tuple[Section[Any, Any], str]]:
    """Yield the entries that were written and could not be read at all."""
    for section in sections_in_use(ROBOT):
        if not section.is_composed or section.name not in manifest.root:
            continue
        read, written = manifest.contents.of(section), at(manifest.root, (section.name, *section.at))
        if isinstance(read, Mapping) and isinstance(written, MappingNode):
            yield from ((section, name) for name in written.entries if name not in read)
        elif read is None:
            yield section, ""


def half_read(findings: Iterable[Finding]) -> set[str]:
    """Return the files in which a key is written twice, so that what stands below one of them was not read."""
    return {finding.span.file for finding in findings if finding.code == TWICE.code and finding.span}


def has_a_section_twice(findings: Iterable[Finding], root: MappingNode) -> bool:
    """Return whether a file has a section with names twice, so that what stands in the second one is not read."""
    words = {entry.key.span for entry in root.entries.values() if isinstance(entry.value, ScalarNode)}
    twice = (one for one in findings if one.code == TWICE.code and one.span and one.span.column == 1)
    return any(words.isdisjoint(other.span for other in finding.related) for finding in twice)


def without_half_entries(
    findings: Sequence[Finding], read_so_far: int, root: MappingNode, given: MappingNode
) -> list[Finding]:
    """Return findings without those about entries that may only change what was not read: what a part brings, or so.

    `read_so_far` is the number of findings from before the sections were read, `given` what the file includes.
    """
    prefixes = tuple(f"{name}_" for name in entries_of(given.get(include.name)))
    halves = Doubts(
        places=_by_line(
            span
            for section in sections_in_use(ROBOT)
            for name, entry in entries_of(root.get(section.name)).items()
            if section.has_topics or name.startswith(prefixes) or not prefixes
            for span in (entry.key.span, entry.value.span)
        )
    )
    return [
        *(one for one in findings[:read_so_far] if one.code != NOTHING_TO_CHANGE.code),
        *(one for one in findings[read_so_far:] if one.code != MISSING_KEY.code or not halves.touch(one, ())),
    ]


def with_removals(
    findings: Iterable[Finding], history: History, profile: Span, ends: Iterable[tuple[str, str]]
) -> Iterator[Finding]:
    """Yield what only a profile causes: one finding for each thing that it removes, instead of those about its absence.

    `ends` are the topics and skills of the robot without the profile, each with its component.
    """
    gone = {name: span for section in sections_in_use() for name, span in history.removed(section.name).items()}
    gone = {name: span for name, span in gone.items() if profile.contains(span)}
    owners = {name: name for name in gone} | {name: component for name, component in ends if component in gone}
    users: dict[str, list[Finding]] = {}
    for finding in findings:
        name = next((owners[name] for name in finding.about if name in owners), None)
        if name is None:
            yield finding
        else:
            users.setdefault(name, []).append(finding)
    for name, used in users.items():
        yield STILL_USED.at(
            gone[name],
            f"this profile removes '{name}', which is still used",
            help="keep it, or let the profile remove or change what uses it, too",
            related=[Related(user.span, user.message) for user in used if user.span][:_MOST_SHOWN],
        )
