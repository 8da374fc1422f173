"""Parts: what `include:` names, under the names of each instance, with what it claims."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import Any

from rbxcompose.base.config import ANYTHING, COMPONENT, CONTROLLER, PORT, PREFIXED, TOPIC, VALUE
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Related, Span, kind
from rbxcompose.compiler.composition.overlay import settled
from rbxcompose.compiler.composition.robot_manifest import About, Claim, IncludedPart, Inclusion, Inclusions
from rbxcompose.compiler.sections.bus import foresee
from rbxcompose.compiler.sections.composition import Include, args, include, needs, provides
from rbxcompose.manifest import tree
from rbxcompose.manifest.documents import Documents, ManifestHeader
from rbxcompose.manifest.files import resolve, shown_name
from rbxcompose.manifest.registry import model_for, naming_in_use, section_named, sections_in_use
from rbxcompose.manifest.section import PART, Contents, RenamedTopic, Section
from rbxcompose.manifest.validate import WRONG_TYPE
from rbxcompose.manifest.yaml_nodes import TOO_LARGE

Rename = Callable[[str], str]


@dataclass(slots=True)
class Renaming:
    """The renaming of one instance; `used` are the topics of `connect` that the part has."""

    prefix: str
    connect: dict[str, RenamedTopic]
    own: dict[str, frozenset[str]]  # by section
    defines: frozenset[str] = frozenset()  # kinds of which all names in the part are its own
    used: set[str] = field(default_factory=set)

    @classmethod
    def of(cls, prefix: str, connect: dict[str, RenamedTopic], roots: Iterable[tree.MappingNode]) -> Renaming:
        """Return the renaming for `roots`: the file of a part and all that it includes."""
        trees = list(roots)
        named = [section for section in sections_in_use() if section.names and section.is_composed]
        own = {section.name: frozenset(name for root in trees for name in section.names_in(root)) for section in named}
        defines = frozenset(
            kind for section in sections_in_use() for kind in section.defines if any(section.name in it for it in trees)
        )
        return cls(prefix, connect, own, defines)

    @property
    def running(self) -> frozenset[str]:
        """Return the names of all that the part runs."""
        return frozenset(name for one in naming_in_use(COMPONENT) for name in self.own[one.name])

    def root(self, root: tree.MappingNode) -> tree.MappingNode:
        """Return the sections of a part under their new names."""
        entries = {}
        for name, entry in root.entries.items():
            section = section_named(name)
            entries[name] = tree.Entry(entry.key, self._section(section, entry.value)) if section else entry
        return replace(root, entries=entries)

    def topic(self, topic: str) -> str:
        """Return the name of a topic of the part outside; an input of a mux follows its mux."""
        if found := self.connect.get(topic):
            self.used.add(topic)
            return found.name
        above, slash, name = topic.rpartition("/")
        if slash and above in self.connect and self._is_own_topic(above):
            return f"{self.topic(above)}/{name}"
        return topic

    def written(self, topic: str) -> RenamedTopic:
        """Return the entry that renames a topic: its own, or that of the topic above it."""
        return self.connect.get(topic) or self.connect[topic.rpartition("/")[0]]

    def component(self, name: str) -> str:
        """Return the new name of something that runs; in `component.port`, the port stays."""
        return self.name(PORT, name)

    def name(self, kind: str, name: str) -> str:
        """Return the new name of something of a kind."""
        if kind == TOPIC:
            return self.topic(name)
        if kind == ANYTHING:
            return self.any_name(name)
        if kind in PREFIXED:
            prefix, named = PREFIXED[kind]
            return f"{prefix}{self.name(named, name.removeprefix(prefix))}" if name.startswith(prefix) else name
        if kind in self.defines:
            return f"{self.prefix}{name}"
        head, dot, rest = name.partition(".") if kind in (PORT, COMPONENT) else (name, "", "")
        for section in naming_in_use(COMPONENT if kind == PORT else kind):
            if head in self.own.get(section.name, ()):
                return f"{self._new(section, head)}{dot}{rest}"
        return name

    def any_name(self, name: str) -> str:
        """Return the new form of a word that may name anything in the part: a value given by `with:`."""
        kinds = (section.names for section in sections_in_use() if section.is_map and section.is_composed)
        changed = (self.name(kind, name) for kind in (COMPONENT, *kinds, *PREFIXED))
        return next((text for text in changed if text != name), name)

    def values(self, given: tree.MappingNode) -> tree.MappingNode:
        """Return the renamed values that a part gives to one that it includes."""
        return tree.with_children(given, lambda _, value: self.texts(value, self.any_name))

    def texts(self, node: tree.TreeNode, change: Rename) -> tree.TreeNode:
        """Return a node with every text below it changed, except those that are filled in later."""
        if not isinstance(node, tree.ScalarNode):
            return tree.with_children(node, lambda _, inner: self.texts(inner, change))
        changed = node.text if "${" in node.text else change(node.text)
        return node if changed == node.text else replace(node, text=changed)

    def topics(self, node: tree.TreeNode, above: str = "") -> tree.TreeNode:
        """Return a map with its keys renamed as topics (below `above`, if given); other nodes stay unchanged."""
        if not isinstance(node, tree.MappingNode):
            return node
        entries = {}
        for name, entry in node.entries.items():
            topic = f"{above}{name}"
            changed = self.topic(topic).removeprefix(self.topic(above.removesuffix("/")) + "/" if above else "")
            # A wrong name is reported where it was given.
            span = self.connect[topic].span if topic in self.connect else entry.key.span
            entries[changed] = tree.Entry(replace(entry.key, text=changed, span=span), entry.value)
        return replace(node, entries=entries)

    def _is_own_topic(self, topic: str) -> bool:
        return any(section.has_topics and topic in self.own.get(section.name, ()) for section in sections_in_use())

    def _new(self, section: Section[Any, Any], name: str) -> str:
        if section.has_topics:
            return self.topic(name)
        instance = self.prefix.removesuffix("_")
        if section.repeats or not (instance == name or instance.endswith(f"_{name}")):
            return f"{self.prefix}{name}"
        return instance

    def _section(self, section: Section[Any, Any], node: tree.TreeNode) -> tree.TreeNode:
        node = section.with_references(node, lambda kind, one: self.texts(one, lambda text: self.name(kind, text)))
        if section.at and isinstance(node, tree.MappingNode):
            return _with(node, section.at[0], lambda named: self._named(section, named))
        return self._named(section, node) if section.names else node

    def _named(self, section: Section[Any, Any], node: tree.TreeNode) -> tree.TreeNode:
        if not isinstance(node, tree.MappingNode):
            return node
        values = {name: section.rename(self, name, entry.value) for name, entry in node.entries.items()}
        changed = {name: tree.Entry(entry.key, values[name]) for name, entry in node.entries.items()}
        if section.has_topics:
            return self.topics(replace(node, entries=changed))
        new = {name: self._new(section, name) for name in changed}
        entries = {
            new[name]: tree.Entry(replace(entry.key, text=new[name]), entry.value) for name, entry in changed.items()
        }
        return replace(node, entries=entries)


def topics_of(roots: Iterable[tree.MappingNode]) -> set[str]:
    """Return the topics in trees that `connect:` of an instance may name."""
    return {
        topic
        for root in roots
        for section in sections_in_use()
        for name in section.names_in(root)
        if (node := tree.at(root, (section.name, *section.at, name))) is not None
        for topic in section.topics(name, node)
    }


def _with(node: tree.MappingNode, key: str, change: Callable[[tree.TreeNode], tree.TreeNode]) -> tree.MappingNode:
    """Return a map with the value of `key` changed, if it has that key."""
    if key not in node.entries:
        return node
    entry = node.entries[key]
    return replace(node, entries={**node.entries, key: tree.Entry(entry.key, change(entry.value))})


def claims_of(part: Contents) -> Iterator[Claim]:
    """Yield the claims that a part's file makes under `needs:` and `provides:`."""
    needed, given = part.of(needs), part.of(provides)
    for section, about, ports in (("needs", About.NEED, needed.ports), ("provides", About.PORT, given.ports)):
        for topic, type_name in ports.items():
            yield Claim(about, topic, type_name, tree.key_span(part.root, (section, "ports", topic)))
    for key, about, names in (("skills", About.SKILL, given.skills), ("values", About.VALUE, given.values)):
        for index, name in enumerate(names):
            yield Claim(about, name, "", tree.value_span(part.root, ("provides", key, index)))


def renamed(claim: Claim, renaming: Renaming) -> Claim:
    """Return a claim with its name outside the part; a skill is a controller, or named like the topic of its action."""
    match claim.about:
        case About.VALUE:
            return replace(claim, name=renaming.name(VALUE, claim.name))
        case About.SKILL:
            name = renaming.name(CONTROLLER, claim.name)
            return replace(claim, name=renaming.topic(name).rpartition("/")[-1])
    return replace(claim, name=renaming.name(TOPIC, claim.name))


CIRCLE = kind("RBX1308")
NO_TOPIC = kind("RBX1309", is_fixable=True)


@dataclass(frozen=True, slots=True)
class PartInstance:
    """One instance of a part: what its file brings, under the names of the robot, and the values of its arguments."""

    name: str  # its path: `arm.hand`
    file: str  # file name in findings
    span: Span  # span of the entry that includes it
    root: tree.MappingNode
    arguments: tree.MappingNode  # the section `args` of its file
    given: tree.MappingNode  # `with:`
    claims: tuple[Claim, ...]


@dataclass(frozen=True, slots=True)
class _File:
    """A part's file: its tree, and what it needs and provides."""

    root: tree.MappingNode
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
    def roots(self) -> Iterator[tree.MappingNode]:
        """Yield the trees of the parts that could be read, each once."""
        return (file.root for file in self._files.values() if file)

    def instances(
        self, root: tree.MappingNode, path: str = "", above: tuple[_Open, ...] = ()
    ) -> Iterator[PartInstance]:
        """Yield the instances from the `include:` of a file, each after those that it includes itself."""
        for name, entry, read in Contents(root, self.robot, self.documents).of(include):
            opened = self._open(read, entry, above) if read else None
            if read is None or opened is None:
                self.is_complete = False
                if self._is_full:
                    return
                continue
            instance = f"{path}.{name}".lstrip(".")
            chain = (entry.key.span, *(open_.span for open_ in reversed(above)))
            self.inclusions.add(shown_name(opened.file), Inclusion(instance, chain))
            if (file := self._read(opened.file, tree.value_span(entry.value, ("part",)))) is not None:
                inside = [*self._inside(instance, file, (*above, opened)), _instance(instance, file, opened, entry)]
                yield from self._renamed(name, read, entry.value, inside)

    def _inside(self, instance: str, file: _File, above: tuple[_Open, ...]) -> Iterator[PartInstance]:
        """Yield the instances that a part includes itself."""
        included = settled(tree.only(file.root, include.name), self.documents.report)
        yield from self.instances(in_scope(included, instance), instance, above)

    @property
    def _is_full(self) -> bool:
        return self._count > tree.INSTANCES or self._size > tree.ALL_BYTES

    def _open(self, read: Include, entry: tree.Entry, above: tuple[_Open, ...]) -> _Open | None:
        """Return the file of an instance, or None after a finding."""
        span = tree.value_span(entry.value, ("part",))
        self._count += 1
        finding = self._limit(span, above)
        if finding is None and "${" in read.part:
            finding = WRONG_TYPE.at(span, "a part's file cannot use '${...}': parts are read before it is filled in")
        file = finding or resolve(read.part, self.documents.writer(span, self.robot), span)
        if isinstance(file, Path):
            if all(open_.file != file for open_ in above):
                return _Open(file, entry.key.span)
            file = _circle([*above, _Open(file, entry.key.span)], span)
        self.documents.report.add(file)
        return None

    def _limit(self, span: Span, above: tuple[_Open, ...]) -> Finding | None:
        if len(above) >= tree.INCLUDE_DEPTH:
            return TOO_LARGE.at(span, f"parts include each other more than {tree.INCLUDE_DEPTH} deep")
        if self._count > tree.INSTANCES:
            return TOO_LARGE.at(span, f"this robot has more than {tree.INSTANCES} instances of parts")
        if self._size > tree.ALL_BYTES:
            return TOO_LARGE.at(span, f"the parts of this robot are larger than {tree.ALL_BYTES:,} bytes together")
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
                foresee(root, path)
                root = self.documents.meant(model_for(PART, root), root)
                self.documents.check(model_for(PART, root), root)
            self._files[path] = _File(root, tuple(claims_of(Contents(root, path, self.documents)))) if root else None
        self._size += len(self.documents.sources.get(shown_name(path), ""))
        self.is_complete &= self._files[path] is not None
        return self._files[path]

    def _renamed(
        self, name: str, read: Include, written: tree.TreeNode, inside: list[PartInstance]
    ) -> Iterator[PartInstance]:
        """Yield an instance and those inside it, under the names of the file that includes it."""
        connect = {
            topic: RenamedTopic(
                new, tree.value_span(written, ("connect", topic)), tree.key_span(written, ("connect", topic))
            )
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


def _brought(name: str, root: tree.MappingNode, entry: tree.TreeNode | None) -> tree.MappingNode:
    """Return the sections of a part as those of the file that includes it; others' were changed when they were."""
    if entry is None:
        return root
    entries = dict(root.entries)
    for section in sections_in_use(PART):
        there = entries.get(section.name)
        if (node := section.brought(name, there.value if there else None, entry)) is not None:
            entries[section.name] = tree.Entry(there.key if there else tree.ScalarNode(section.name, node.span), node)
    return replace(root, entries=entries)


def _instance(name: str, file: _File, opened: _Open, entry: tree.Entry) -> PartInstance:
    """Return an instance with the names of its own file."""
    scoped = in_scope(file.root, name)
    own = {
        *ManifestHeader.model_fields,
        *(section.name for section in sections_in_use(PART) if not section.is_composed),
    }
    given = tree.at(entry.value, ("with",))
    return PartInstance(
        name=name,
        file=shown_name(opened.file),
        span=opened.span,
        root=tree.without(scoped, *own),
        arguments=tree.only(scoped, args.name),
        given=given if isinstance(given, tree.MappingNode) else tree.MappingNode({}, opened.span),
        claims=file.claims,
    )


def _circle(chain: list[_Open], span: Span) -> Finding:
    """Return the finding for a file that includes itself; it is last in `chain`, and in it once before."""
    start = next(index for index, open_ in enumerate(chain) if open_.file == chain[-1].file)
    names = " -> ".join(shown_name(open_.file) for open_ in chain[start:])
    related = [Related(open_.span, f"'{shown_name(open_.file)}' is included here") for open_ in chain[start + 1 :]]
    return CIRCLE.at(span, f"parts include each other in a circle: {names}", related=related)


def in_scope(root: tree.MappingNode, scope: str) -> tree.MappingNode:
    """Return a tree whose `${args...}` refer to the arguments of the instance `scope`."""

    def scoped(_: tree.Key, node: tree.TreeNode) -> tree.TreeNode:
        if not isinstance(node, tree.ScalarNode):
            return tree.with_children(node, scoped)
        return replace(node, scope=scope) if "$" in node.text else node

    return tree.with_children(root, scoped)


def included_parts(instances: Sequence[PartInstance]) -> dict[str, IncludedPart]:
    """Return the instances for the checks; what a part includes counts as its own."""
    found = {}
    for instance in instances:
        own = [other for other in instances if f"{other.name}.".startswith(f"{instance.name}.")]
        roots = [other.root for other in own]
        running = list(naming_in_use(COMPONENT))
        components = _names(roots, (declaration for declaration in running if not declaration.has_topics))
        muxes = _names(roots, (declaration for declaration in running if declaration.has_topics))
        values = _names(roots, naming_in_use(VALUE))
        found[instance.name] = IncludedPart(
            instance.name, instance.file, instance.span, components, muxes, values, instance.claims
        )
    return found


def _names(roots: Iterable[tree.MappingNode], those: Iterable[Section[Any, Any]]) -> frozenset[str]:
    chosen = list(those)
    return frozenset(name for root in roots for section in chosen for name in section.names_in(root))
