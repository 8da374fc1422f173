"""Parts: read what `include:` names, and put what each instance brings under the names of the robot."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import Any

from rbxcompose.composition.claims import claims_of, renamed
from rbxcompose.composition.inclusions import Inclusion, Inclusions
from rbxcompose.composition.instance_names import Renaming, topics_of
from rbxcompose.composition.overlay import settled
from rbxcompose.composition.robot_manifest import Claim, IncludedPart
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Related, Span, kind
from rbxcompose.manifest.documents import Documents
from rbxcompose.manifest.file_models import file_model
from rbxcompose.manifest.files import resolve, shown_name
from rbxcompose.manifest.header import ManifestHeader
from rbxcompose.manifest.limits import ALL_BYTES, INCLUDE_DEPTH, INSTANCES
from rbxcompose.manifest.registry import naming, sections
from rbxcompose.manifest.renamer import RenamedTopic
from rbxcompose.manifest.section import PART, Contents, Section
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode, at, key_span, value_span
from rbxcompose.manifest.validate import WRONG_TYPE
from rbxcompose.manifest.yaml_nodes import TOO_LARGE
from rbxcompose.references import COMPONENT, VALUE
from rbxcompose.sections.args import args
from rbxcompose.sections.include import Include, include

CIRCLE = kind("RBX1308")
NO_TOPIC = kind("RBX1309", is_fixable=True)


@dataclass(frozen=True, slots=True)
class PartInstance:
    """One instance of a part: what its file brings, under the names of the robot, and the values of its arguments."""

    name: str  # its path: `arm.hand`
    file: str  # file name in findings
    span: Span  # span of the entry that includes it
    root: MappingNode
    arguments: MappingNode  # the section `args` of its file
    given: MappingNode  # `with:`
    claims: tuple[Claim, ...]


@dataclass(frozen=True, slots=True)
class _File:
    """A part's file: its tree, and what it needs and provides."""

    root: MappingNode
    claims: tuple[Claim, ...]


@dataclass(frozen=True, slots=True)
class _Open:
    """A file that is being included, and the entry that includes it."""

    file: Path
    span: Span


@dataclass(slots=True)
class Parts:
    """Reads the instances of one robot; `is_complete` is whether all could be read."""

    documents: Documents
    robot: Path
    inclusions: Inclusions = field(default_factory=Inclusions)
    is_complete: bool = True
    _files: dict[Path, _File | None] = field(default_factory=dict)
    _count: int = 0
    _size: int = 0

    @property
    def roots(self) -> Iterator[MappingNode]:
        """Yield the trees of the parts that could be read, each once."""
        return (file.root for file in self._files.values() if file)

    def instances(self, root: MappingNode, path: str = "", above: tuple[_Open, ...] = ()) -> Iterator[PartInstance]:
        """Yield the instances from the `include:` of a file, each after those that it includes itself."""
        for name, entry, read in Contents(root, self.robot, self.documents).of(include):
            opened = self._open(read, entry, above) if read else None
            if read is None or opened is None:
                self.is_complete = False
                if self._is_full:
                    return
                continue
            instance = f"{path}.{name}".lstrip(".")
            chain = (entry.key.span, *(one.span for one in reversed(above)))
            self.inclusions.add(shown_name(opened.file), Inclusion(instance, chain))
            if (file := self._read(opened.file, value_span(entry.value, ("part",)))) is not None:
                inside = [*self._inside(instance, file, (*above, opened)), _instance(instance, file, opened, entry)]
                yield from self._renamed(name, read, entry.value, inside)

    def _inside(self, instance: str, file: _File, above: tuple[_Open, ...]) -> Iterator[PartInstance]:
        """Yield the instances that a part includes itself."""
        included = replace(file.root, entries={n: e for n, e in file.root.entries.items() if n == include.name})
        yield from self.instances(in_scope(settled(included, self.documents.report), instance), instance, above)

    @property
    def _is_full(self) -> bool:
        return self._count > INSTANCES or self._size > ALL_BYTES

    def _open(self, read: Include, entry: Entry, above: tuple[_Open, ...]) -> _Open | None:
        """Return the file of an instance, or None after a finding."""
        span = value_span(entry.value, ("part",))
        self._count += 1
        finding = self._limit(span, above)
        if finding is None and "${" in read.part:
            finding = WRONG_TYPE.at(span, "a part's file cannot use '${...}': parts are read before it is filled in")
        file = finding or resolve(read.part, self.documents.writer(span, self.robot), span)
        if isinstance(file, Path):
            if all(one.file != file for one in above):
                return _Open(file, entry.key.span)
            file = _circle([*above, _Open(file, entry.key.span)], span)
        self.documents.report.add(file)
        return None

    def _limit(self, span: Span, above: tuple[_Open, ...]) -> Finding | None:
        if len(above) >= INCLUDE_DEPTH:
            return TOO_LARGE.at(span, f"parts include each other more than {INCLUDE_DEPTH} deep")
        if self._count > INSTANCES:
            return TOO_LARGE.at(span, f"this robot has more than {INSTANCES} instances of parts")
        if self._size > ALL_BYTES:
            return TOO_LARGE.at(span, f"the parts of this robot are larger than {ALL_BYTES:,} bytes together")
        return None

    def _read(self, path: Path, span: Span) -> _File | None:
        """Return a part's file, read only once; None after findings. `span` is that of the path that names it."""
        known = self._files.get(path)
        if known is not None and (finding := self.documents.use(path, known.root)):
            self.documents.report.add(replace(finding, span=span))
            self.is_complete = False
            return None
        if path not in self._files:
            root = self.documents.read(path, PART, span)
            if root is not None:
                root = self.documents.meant(file_model(PART), root)
                self.documents.check(file_model(PART), root)
            self._files[path] = _File(root, tuple(claims_of(Contents(root, path, self.documents)))) if root else None
        self._size += len(self.documents.sources.get(shown_name(path), ""))
        self.is_complete &= self._files[path] is not None
        return self._files[path]

    def _renamed(
        self, name: str, read: Include, written: TreeNode, inside: list[PartInstance]
    ) -> Iterator[PartInstance]:
        """Yield an instance and those inside it, under the names of the file that includes it."""
        connect = {
            topic: RenamedTopic(new, value_span(written, ("connect", topic)), key_span(written, ("connect", topic)))
            for topic, new in read.connect.items()
        }
        renaming = Renaming.of(f"{name}_", connect, [instance.root for instance in inside])
        for instance in inside:
            is_own = instance is inside[-1]  # its given values already use the names of the including file
            yield replace(
                instance,
                root=_brought(name, renaming.root(instance.root), written if is_own else None),
                given=instance.given if is_own else renaming.values(instance.given),
                claims=tuple(renamed(claim, renaming) for claim in instance.claims),
            )
        topics = topics_of(instance.root for instance in inside)
        for topic in sorted(connect.keys() - renaming.used):
            message = f"the part of the instance '{name}' has no topic '{topic}'"
            span = connect[topic].key_span
            finding = NO_TOPIC.misspelt(span, message, topic, topics, "its topics", taken=connect)
            self.documents.report.add(finding)


def _brought(name: str, root: MappingNode, entry: TreeNode | None) -> MappingNode:
    """Return the sections of a part as those of the file that includes it; others' were changed when they were."""
    if entry is None:
        return root
    entries = dict(root.entries)
    for one in sections(PART):
        there = entries.get(one.name)
        if (node := one.brought(name, there.value if there else None, entry)) is not None:
            entries[one.name] = Entry(there.key if there else ScalarNode(one.name, node.span), node)
    return replace(root, entries=entries)


def _instance(name: str, file: _File, opened: _Open, entry: Entry) -> PartInstance:
    """Return an instance with the names of its own file."""
    scoped = in_scope(file.root, name)
    own = {*ManifestHeader.model_fields, *(one.name for one in sections(PART) if not one.is_composed)}
    given = at(entry.value, ("with",))
    return PartInstance(
        name=name,
        file=shown_name(opened.file),
        span=opened.span,
        root=replace(scoped, entries={key: one for key, one in scoped.entries.items() if key not in own}),
        arguments=replace(scoped, entries={key: one for key, one in scoped.entries.items() if key == args.name}),
        given=given if isinstance(given, MappingNode) else MappingNode({}, opened.span),
        claims=file.claims,
    )


def _circle(chain: list[_Open], span: Span) -> Finding:
    """Return the finding for a file that includes itself; it is last in `chain`, and in it once before."""
    start = next(index for index, one in enumerate(chain) if one.file == chain[-1].file)
    names = " -> ".join(shown_name(one.file) for one in chain[start:])
    related = [Related(one.span, f"'{shown_name(one.file)}' is included here") for one in chain[start + 1 :]]
    return CIRCLE.at(span, f"parts include each other in a circle: {names}", related=related)


def in_scope(root: MappingNode, scope: str) -> MappingNode:
    """Return a tree whose `${args...}` refer to the arguments of the instance `scope`."""

    def scoped(node: TreeNode) -> TreeNode:
        match node:
            case ScalarNode(text=text):
                return replace(node, scope=scope) if "$" in text else node
            case SequenceNode(items=items):
                return replace(node, items=tuple(map(scoped, items)))
            case MappingNode(entries=entries):
                return replace(node, entries={name: Entry(one.key, scoped(one.value)) for name, one in entries.items()})

    return replace(root, entries={name: Entry(one.key, scoped(one.value)) for name, one in root.entries.items()})


def included_parts(instances: Sequence[PartInstance]) -> dict[str, IncludedPart]:
    """Return the instances for the checks; what a part includes counts as its own."""
    found = {}
    for one in instances:
        own = [other for other in instances if f"{other.name}.".startswith(f"{one.name}.")]
        roots = [other.root for other in own]
        running = list(naming(COMPONENT))
        components = _names(roots, (one for one in running if not one.has_topics))
        muxes = _names(roots, (one for one in running if one.has_topics))
        values = _names(roots, naming(VALUE))
        found[one.name] = IncludedPart(one.name, one.file, one.span, components, muxes, values, one.claims)
    return found


def _names(roots: Iterable[MappingNode], those: Iterable[Section[Any, Any]]) -> frozenset[str]:
    chosen = list(those)
    return frozenset(name for root in roots for section in chosen for name in section.names_in(root))
