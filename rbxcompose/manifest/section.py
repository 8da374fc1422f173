"""What is known about a section of the manifest, and what is read from it."""

from __future__ import annotations

import re
from collections import ChainMap
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, field, replace
from enum import Enum
from functools import cache, cached_property
from itertools import chain
from pathlib import Path, PurePosixPath
from types import GenericAlias
from typing import Annotated, Any, Generic, Literal, Protocol, TypeVar, cast

from pydantic import BeforeValidator

from rbxcompose.base.config import COMPONENT, CONTENTS, DEFAULT, FOLDER, Config, Name, Refers, Restart, When
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import DID_YOU_MEAN, Finding, Report, Span, nearest, surely_meant
from rbxcompose.base.printable import plain
from rbxcompose.manifest.documents import Documents, ManifestHeader
from rbxcompose.manifest.fields import ComponentName, TopicName
from rbxcompose.manifest.shapes import below, keys_at, kinds_of, with_references
from rbxcompose.manifest.tree import (
    Entry,
    KeyPath,
    MappingNode,
    ScalarNode,
    SequenceNode,
    TreeNode,
    at,
    entries_of,
    is_empty,
    key_span,
    value_span,
)
from rbxcompose.manifest.validate import (
    MISSING_KEY,
    UNKNOWN_KEY,
    WRONG_TYPE,
    is_broken,
    is_valid,
    label_of,
    salvaged,
    validate,
)


@dataclass(frozen=True, slots=True)
class RenamedTopic:
    """The new name of a topic of a part, and where it is written."""

    name: str
    span: Span
    key_span: Span


class Renames(Protocol):
    """The names of one instance of a part, and what they become in the file that includes it."""

    @property
    def prefix(self) -> str:
        """Return the prefix of its names."""

    @property
    def running(self) -> frozenset[str]:
        """Return the names of all that the part runs."""

    def component(self, name: str) -> str:
        """Return the new name of something that runs; `component.port` keeps its port."""

    def topic(self, topic: str) -> str:
        """Return the new name of a topic."""

    def written(self, topic: str) -> RenamedTopic:
        """Return the entry that renames a topic: its own, or that of a topic above it."""

    def topics(self, node: TreeNode, above: str = "") -> TreeNode:
        """Return a map whose keys are topics (below `above`, if given) with these keys renamed."""

    def texts(self, node: TreeNode, change: Callable[[str], str]) -> TreeNode:
        """Return a node with every text below it changed, except those that are filled in later."""


def is_misplaced(entry: TreeNode, keys: Collection[str], own: Collection[str]) -> bool:
    """Return whether an entry with the name of a section is that section, and no entry of the section around it.

    `keys` are those of the section, none if it takes any name; `own` are those of an entry.
    """
    if not isinstance(entry, MappingNode) or not entry.entries:
        return False
    is_section = not keys or any(name in keys for name in entry.entries)
    return is_section and not any(nearest(name, own) for name in entry.entries)


def misplaced(key: ScalarNode, around: str) -> Finding:
    """Return the finding about the key of a section that is indented below the section `around`."""
    span, name = key.span, key.text
    message = f"'{name}' is a section of the file; here it belongs to '{around}'"
    columns = "1 column" if span.column == 2 else f"{span.column - 1} columns"
    help_text = f"move it, with all below it, {columns} to the left" if span.column > 1 else ""
    return UNKNOWN_KEY.at(span, message, help=help_text)


def with_namesake(findings: Iterable[Finding], name: str, names: Iterable[str]) -> Iterator[Finding]:
    """Yield the findings about an entry; one about a key that it lacks tells the entry that was surely meant."""
    others = [other for other in names if other != name]
    for finding in findings:
        is_lacking = finding.code == MISSING_KEY.code and not finding.help
        meant = surely_meant(name, others) if is_lacking else None
        yield replace(finding, help=f"{DID_YOU_MEAN} '{meant}', which has it?") if meant else finding


@dataclass(frozen=True, slots=True)
class Short:
    """One word in place of an entry with one key: `patrol: FILE` is `{file: FILE}`."""

    key: str
    is_merged: bool = True
    """Whether layers may change single keys of such an entry; otherwise they replace it as a whole."""
    only_over: str = ""
    """Meaning of the word, if only an overlay may use the short form."""


@cache
def short_type_of(model: Any, key: str) -> Any:
    """Return the type of the word in place of an entry."""
    return Annotated[(str, *(Refers(kind, is_reported=True) for kind in kinds_of(next(below(model, key)))))]


@cache  # each type is compiled once
def entry_type_of(model: Any, short: Short) -> Any:
    """Return the type of an entry, whole or short."""
    word = short_type_of(model, short.key)
    read = BeforeValidator(
        lambda value: {short.key: value} if isinstance(value, str) else value, json_schema_input_type=model | word
    )
    return Annotated[model, read]


NAME = "name"
_MOST_SHOWN = 3
_LONGEST = 60
_NO_NAME = re.compile(r"[^a-z0-9_]+|^[^a-z]+")


def name_of(item: TreeNode) -> str:
    """Return the name that an item of a list probably has: that under `name`, or that of the file that it names."""
    match item:
        case MappingNode(entries=entries) if len(entries) == 1:
            (name,) = entries
            inner = entries[name].value
            return name_of(inner) if isinstance(inner, ScalarNode) else name
        case MappingNode(entries=entries):
            named = item.get(NAME) or next((entry.value for entry in entries.values() if _is_path(entry.value)), None)
            return name_of(named) if isinstance(named, ScalarNode) else ""
        case ScalarNode(text=text):
            return _NO_NAME.sub("_", PurePosixPath(text.replace("\\", "/")).stem.lower()).strip("_")
    return ""


def entry_of(item: TreeNode) -> TreeNode:
    """Return what an item is below its name."""
    if not isinstance(item, MappingNode):
        return item
    if len(item.entries) == 1 and not isinstance(only := next(iter(item.entries.values())).value, ScalarNode):
        return only
    return MappingNode({key: entry for key, entry in item.entries.items() if key != NAME}, item.span)


def help_with_names(node: TreeNode | None) -> str:
    """Return what to write instead of a list, or of a single file, where entries need names; empty for others."""
    match node:
        case ScalarNode() if _is_path(node) and name_of(node):
            return f"it needs a name: write '{name_of(node)}: {_shown(node)}' below it"
        case SequenceNode(items=items) if items and all(map(name_of, items)):
            shown = " and ".join(f"'{name_of(item)}:{_rest(item)}'" for item in items[:_MOST_SHOWN])
            rest = f", and so on for {len(items) - _MOST_SHOWN} more" if len(items) > _MOST_SHOWN else ""
            return f"each needs a name instead of its dash: {shown}{rest}"
        case SequenceNode():
            return "each needs a name instead of its dash: 'NAME:'"
    return ""


def _rest(item: TreeNode) -> str:
    return f" {_shown(item)}" if isinstance(item, ScalarNode) else ""


def _shown(scalar: ScalarNode) -> str:
    return plain(scalar.text, _LONGEST)


def _is_path(node: TreeNode) -> bool:
    return isinstance(node, ScalarNode) and "." in node.text and " " not in node.text


OWN_PORT = "own port"
"""A port of the component whose options these are."""


def _spelt_out(value: Any) -> Any:
    return {"when": value} if isinstance(value, str) else value


RestartModel = Annotated[Restart, BeforeValidator(_spelt_out, json_schema_input_type=Restart | When)]


class ComponentOptions(Config):
    """What every component takes besides its own configuration."""

    process: Name | None = None
    """Its process group; components of one group share a process."""
    starts_after: tuple[ComponentName, ...] = ()
    """Components that must be active before this one starts."""
    restart: RestartModel = DEFAULT
    """Whether and when it restarts after a failure: a word, or a map with `when`, `max`, `within` and `backoff`."""
    log: Literal["info", "warn", "error"] = "info"
    """The lowest level that it logs."""
    connect: dict[Annotated[Name, Refers(OWN_PORT, is_reported=True)], TopicName] = {}
    """Topics by port, where they differ from the port's name."""


OPTIONS = tuple(ComponentOptions.model_fields)


@dataclass(frozen=True, slots=True)
class WantedComponent:
    """A component that a section requests; `path` is the place in the manifest that does so."""

    name: str
    type_name: str
    config: Config | Mapping[str, object]
    """Its configuration, or the data from which its type makes one."""
    path: KeyPath
    options: ComponentOptions = field(default_factory=ComponentOptions)
    places: Mapping[str, KeyPath] = field(default_factory=dict)
    """Where the manifest has fields and ports that it got from elsewhere: `{"controllers.base": ("controllers",
    "base")}`."""
    is_sound: bool = True
    """Whether its configuration is what the user meant; otherwise only its ports count."""


class Wiring(Protocol):
    """The wires of the components known so far."""

    @property
    def components(self) -> Mapping[str, Any]:
        """Return these components by name, each a `RobotComponent`: a section without names of its own sees all."""

    def message_of(self, topic: str) -> str:
        """Return the type of a subscriber of a topic, else of a publisher below it; empty if there is none."""

    def drives(self, topic: str) -> bool:
        """Return whether a base follows the commands on a topic."""


M = TypeVar("M")
R = TypeVar("R")
T = TypeVar("T")

ROBOT, PART, OVERLAY, TEST, SYSTEM = "Robot", "Part", "Overlay", "Test", "System"
EVERYWHERE = (ROBOT, PART, OVERLAY)
ANY = "*"
"""Any key, in a path of `Section.shared`."""


class SetScope(Enum):
    """What a path of `--set` may name in a section."""

    NOTHING = "nothing"
    ANYTHING = "an entry as a whole, or what stands in it"
    KEYS = "what stands in an entry"
    BARE = "what stands in an entry, whose name may come first in the path, without the section"


@dataclass(frozen=True, slots=True)
class AlwaysRun:
    """A component that every robot runs, named after its type."""

    type_name: str
    config: Callable[[Contents, Sequence[str]], Mapping[str, object]]
    """Returns the data of its configuration; it is given the names of all components of the robot."""


@dataclass(frozen=True, slots=True)
class Declaration(Generic[M]):
    """How a section is declared; `M` is the model of an entry, or of the whole section if its keys are fixed."""

    name: str
    model: type[M]
    _: KW_ONLY
    files: tuple[str, ...] = EVERYWHERE
    """Kinds of manifests that may contain it."""
    documents: Mapping[str, type[ManifestHeader]] = field(default_factory=dict)
    """Kinds of manifests of its own, which it names and reads, with their models: their schemas follow from these."""
    order: int = 95
    """Its place among the others: in schemas, in the reference, and when components are made."""

    names: str = ""
    """Kind of name that its keys define; empty if the keys are fixed."""
    runs: bool = False
    """Whether each entry is a component that runs under the entry's name."""
    at: tuple[str, ...] = ()
    """Path to these keys within the section, if they are not directly below it."""
    entry: str = ""
    """What findings call an entry."""
    short: Short | None = None
    stand_in: Callable[[str], object] = lambda name: name
    """Returns what a name means that could not be read."""
    running: frozenset[str] = frozenset()
    """Keys of an entry whose text is an expression for the running robot: `$name` is looked up then."""
    needs: str = ""
    """The key that every new entry in an overlay has; an entry without it was meant to change an existing one."""
    scope: SetScope = SetScope.ANYTHING

    is_composed: bool = True
    """Whether it is part of the composed robot; otherwise only composition reads it."""
    shared: tuple[tuple[str, ...], ...] | None = None
    """Maps to which several parts may add, as paths below the section, with `ANY` for any key; `()` is the section.

    Without it, they may add to a section whose keys are names."""
    has_topics: bool = False
    """Whether its keys are topics, which get no prefix when a part brings them."""
    clash: Callable[[Sequence[str]], tuple[str, str] | None] = lambda names: None
    """Tells of what two parts bring under a path in the section: what it is, and what helps."""
    models: Callable[[TreeNode], Iterable[Any]] | None = None
    """Returns the models of one entry, if they depend on its content."""
    types: Callable[[], Mapping[str, Any]] | None = None
    """Returns the classes that an entry may name as its `type`, by name: each has a `config_type()`, which is the model
    of such an entry."""
    repeats: bool = True
    """Whether a name in a part gets the instance's name as a prefix even if that ends with it: without, the entry `arm`
    of the part `right_arm` is `right_arm`."""
    rename: Callable[[Renames, str, TreeNode], TreeNode] = lambda renames, name, node: node
    """Further changes to an entry of a part after its references were renamed."""
    topics: Callable[[str, TreeNode], Iterable[str]] = lambda name, node: ()
    """Topics of an entry that `connect:` of an instance may name."""

    brought: Callable[[str, TreeNode | None, TreeNode], TreeNode | None] = lambda instance, node, entry: node
    """Returns what the section of a part becomes in the file that includes it; it is given the instance, the section,
    if the part has it, and the entry in `include`."""
    defines: tuple[str, ...] = ()
    """Kinds of names that it defines outside the manifest; in a part that has the section, they are the part's own."""
    defined: Callable[[Any], Mapping[str, Mapping[str, object]]] = lambda read: {}
    """Returns these names by kind, given what was read; none for a kind that could not be read."""

    brings: tuple[str, ...] = ()
    """Names of the components that it adds if it is present."""
    outputs: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    """Outputs of these that muxes may take: component -> port -> topic."""
    components: Callable[[Contents, Wiring], Iterable[WantedComponent]] = lambda contents, wiring: ()
    """Returns the components that it defines."""
    always: AlwaysRun | None = None
    """The component that it configures, and that every robot runs, with or without this section."""
    levels: Callable[[Contents], Mapping[str, str]] = lambda contents: {}
    """Names of levels (`ok`, `warn`, ...) that values read as `SECTION.NAME`, each with the name of its status in
    `/diagnostics_agg`."""
    defaults: Callable[[Contents], Mapping[str, object]] = lambda contents: {}
    """Returns what fields of these names, in components that do not set them, are in place of their own defaults."""
    wires: bool = False
    """Whether its entries decide which components there are, and what they are connected to."""
    connects: Callable[[Contents], Mapping[str, Mapping[str, str]]] = lambda contents: {}
    """Topics that it assigns to ports: component -> port -> topic."""
    details: Callable[[Any], Mapping[str, str]] = lambda read: {}
    """A few words on each of its names, for editors; it is given what was read."""

    @property
    def is_map(self) -> bool:
        """Return whether its keys are names chosen by the user."""
        return bool(self.names) and not self.at

    def types_of(self, entry: TreeNode) -> Iterable[Any]:
        """Return the types that describe an entry."""
        if isinstance(entry, ScalarNode):
            return (self.short_type,)
        return self.models(entry) if self.models else (self.model,)

    def keys_of(self, entry: Entry) -> set[str]:
        """Return the keys that an entry may have."""
        if self.at:
            return set(keys_at(self.model, (*self.at, entry.key.text)))
        return {key for type_ in self.types_of(entry.value) for key in keys_at(type_, ())}

    def has_names_of(self, kind: str) -> bool:
        """Return whether its keys are names of a kind; everything that runs is a component, too."""
        return kind == self.names or (kind == COMPONENT and self.runs)

    def is_shared(self, path: KeyPath) -> bool:
        """Return whether several parts may add to the map at a path below it."""
        patterns = self.shared if self.shared is not None else [()] if self.is_map else []
        return any(
            len(pattern) == len(path) and all(name in (ANY, key) for name, key in zip(pattern, path, strict=True))
            for pattern in patterns
        )

    @property
    def entry_type(self) -> Any:
        """Return the type of an entry: the model, or the word that abbreviates it."""
        model: Any = self.model
        return entry_type_of(model, self.short) if self.short and not self.short.only_over else model

    @property
    def short_type(self) -> Any:
        """Return the type of the word that abbreviates an entry."""
        model: Any = self.model
        return short_type_of(model, self.short.key) if self.short else str

    @property
    def type(self) -> Any:
        """Return the type of the section's contents."""
        return GenericAlias(dict, (Name, self.entry_type)) if self.is_map else self.model

    def with_references(self, node: TreeNode, change: Callable[[str, TreeNode], TreeNode]) -> TreeNode:
        """Return the section's contents with each name of something replaced by `change(kind, value)`."""
        if not self.is_map or not isinstance(node, MappingNode):
            return with_references(node, self.type, change)
        entries = {}
        for name, entry in node.entries.items():
            value = entry.value
            for hint in self.types_of(value):
                value = with_references(value, hint, change)
            entries[name] = Entry(entry.key, value)
        return replace(node, entries=entries)

    def is_unreadable(self, root: MappingNode) -> bool:
        """Return whether something stands in a tree where the section's names should, and is no map."""
        places = ((self.name, *self.at)[:length] for length in range(1, len(self.at) + 2))
        found = (node for node in (at(root, place) for place in places) if node is not None)
        return any(not isinstance(node, MappingNode) and not is_empty(node) for node in found)

    def names_in(self, root: MappingNode) -> Iterable[str]:
        """Return the names that a tree defines in this section."""
        return entries_of(at(root, (self.name, *self.at)) if self.names else None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Section(Declaration[M], Generic[M, R]):
    """A section of the manifest; `R` is the type of what is read from it."""

    doc: str
    """Its purpose, shown in editors and in the reference."""
    example: str
    """YAML for the reference; a test compiles it within the patrol robot."""
    read: Callable[[Reading[M]], R]

    def described(self, contents: Contents) -> Mapping[str, str]:
        """Return the names that were read, each with a few words; none for a section that composition reads."""
        if not self.is_composed:
            return {}
        read = contents.of(self)
        return self.details(read) or dict.fromkeys(read if isinstance(read, Mapping) else (), self.entry)


class Contents:
    """The contents of the sections of a filled tree: each is read when it is first requested."""

    def __init__(
        self,
        root: MappingNode,
        file: Path,
        documents: Documents,
        sections: Iterable[Section[Any, Any]] = (),
        *,
        others: Callable[[], Iterable[Section[Any, Any]]] = tuple,
        named: Callable[[str], Section[Any, Any] | None] = lambda name: None,
        is_simulated: bool = True,
        is_whole: bool = True,
    ) -> None:
        self.root, self.file, self.documents, self.is_simulated = root, file, documents, is_simulated
        self.is_whole = is_whole
        """Whether all files that the tree was composed of could be read."""
        self._sections = list(sections if is_whole else others())
        self._others, self._named = others, named
        self._read: dict[str, object] = {}
        self._reading: set[str] = set()

    def of(self, section: Section[Any, R]) -> R:
        """Return the contents of a section; mistakes are added to the report of the documents."""
        if section.name not in self._read:
            self._reading.add(section.name)
            self._read[section.name] = section.read(Reading(section, self))
            self._reading.remove(section.name)
        return cast(R, self._read[section.name])

    def is_being_read(self, section: Section[Any, Any]) -> bool:
        """Return whether a section asks while it is read itself, before it knows what it defines."""
        return section.name in self._reading

    def may_have(self, kind: str, name: str) -> bool:
        """Return whether a name that was not found may stand where nothing could be read, so that it is not wrong."""
        return kind in self.open_kinds or name in self.stray or self.is_unread(kind)

    def is_unread(self, kind: str) -> bool:
        """Return whether a file that defines names of a kind could not be read."""
        defining = (one for one in self._sections if kind in one.defines and one.name in self.root)
        return any(self._read.get(one.name, one) is None for one in defining)

    def brought(self, kind: str) -> dict[str, object]:
        """Return the names of a kind that sections define outside the manifest."""
        defining = (section for section in self._sections if kind in section.defines)
        return {name: value for one in defining for name, value in one.defined(self.of(one)).get(kind, {}).items()}

    @cached_property
    def open_kinds(self) -> frozenset[str]:
        """Return the kinds of which any name may exist: a section that defines them is no map, or a file lacks."""
        naming = [one for one in self._sections if one.names and (not self.is_whole or one.is_unreadable(self.root))]
        return frozenset((*(section.names for section in naming), *(COMPONENT for section in naming if section.runs)))

    @cached_property
    def stray(self) -> frozenset[str]:
        """Return the names below keys that are no sections, which may belong to any, and those that were misspelt."""
        known = {*ManifestHeader.model_fields, *(section.name for section in self._sections)}
        others = (entry.value for name, entry in self.root.entries.items() if name not in known)
        below = [name for node in others if isinstance(node, MappingNode) for name in node.entries]
        named = (name for section in self._sections for name in section.names_in(self.root) if not name.isidentifier())
        return frozenset((*below, *(re.sub(r"\W+", "_", name) for name in named)))

    def is_misplaced(self, section: Section[Any, Any], entry: Entry) -> bool:
        """Return whether an entry of a section is another section of the file, indented too far."""
        other = self._named(entry.key.text)
        if other is None:
            return False
        keys = () if other.is_map else keys_at(other.model, ())
        return is_misplaced(entry.value, keys, section.keys_of(entry))

    @cached_property
    def known(self) -> Mapping[str, Mapping[str, object]]:
        """Return the names of each kind, including entries with mistakes: references to them are not wrong."""
        return _Kinds(self._known_from(self._sections), lambda: self._others_known)

    def known_in(self, span: Span) -> Mapping[str, object]:
        """Return what validators may look up for what is written at a place; it is found only when they do."""
        own: dict[str, object] = {FOLDER: str(Path(span.file).absolute().parent), CONTENTS: self}
        return ChainMap(own, cast(dict[str, object], self.known))

    @cached_property
    def _others_known(self) -> Mapping[str, Mapping[str, object]]:
        return self._known_from(self._others())

    def _known_from(self, sections: Iterable[Section[Any, Any]]) -> dict[str, Mapping[str, object]]:
        all_ = list(sections)
        naming = [section for section in all_ if section.names]
        kinds = {COMPONENT, *(section.names for section in naming)}
        defined = {(kind, section.name): _Defined(self, section, kind) for section in all_ for kind in section.defines}
        found: dict[str, Mapping[str, object]] = {
            kind: _Names(
                self,
                kind,
                [section for section in naming if section.has_names_of(kind)],
                [names for (one, _), names in defined.items() if one == kind],
            )
            for kind in kinds
        }
        return {kind: names for (kind, _), names in defined.items()} | found


class _Kinds(Mapping[str, Mapping[str, object]]):
    """The names of each kind; sections that are not in use are asked only for a kind that those in use do not have."""

    def __init__(
        self, used: Mapping[str, Mapping[str, object]], others: Callable[[], Mapping[str, Mapping[str, object]]]
    ) -> None:
        self._used, self._others = used, others

    def __getitem__(self, kind: str) -> Mapping[str, object]:
        return self._used[kind] if kind in self._used else self._others()[kind]

    def __iter__(self) -> Iterator[str]:
        return iter({**self._used, **self._others()})

    def __len__(self) -> int:
        return len({**self._used, **self._others()})


class _Names(Mapping[str, object]):
    """The names of a kind; what a name means is read on request."""

    def __init__(
        self,
        contents: Contents,
        kind: str,
        sections: Iterable[Section[Any, Any]],
        brought: Iterable[Mapping[str, object]],
    ) -> None:
        self._contents, self._kind, self._brought = contents, kind, list(brought)
        chosen = list(sections)
        self._section = {name: section for section in chosen for name in section.names_in(contents.root)}
        self._default = chosen[0] if chosen else None

    def __getitem__(self, name: str) -> object:
        section = self._section.get(name, self._default)
        read = self._contents.of(section) if section else None
        there = read.get(name) if isinstance(read, Mapping) else None
        return there if there is not None else section.stand_in(name) if section else name

    def __contains__(self, name: object) -> bool:
        is_known = name in self._section or any(name in names for names in self._brought)
        return is_known or self._contents.may_have(self._kind, str(name))

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*self._section, *chain.from_iterable(self._brought))))

    def __len__(self) -> int:
        return sum(1 for _ in self)


class _Defined(Mapping[str, object]):
    """The names of a kind that a section defines outside the manifest; any name, if they could not be read."""

    def __init__(self, contents: Contents, section: Section[Any, Any], kind: str) -> None:
        self._contents, self._section, self._kind = contents, section, kind

    @property
    def _there(self) -> Mapping[str, object]:
        if self._contents.is_being_read(self._section):
            return {}
        return self._section.defined(self._contents.of(self._section)).get(self._kind, {})

    def __getitem__(self, name: str) -> object:
        return self._there[name]

    def __contains__(self, name: object) -> bool:
        if self._contents.is_being_read(self._section):
            return False
        read = self._contents.of(self._section)
        return name in self._there or (read is None and self._section.name in self._contents.root)

    def __iter__(self) -> Iterator[str]:
        return iter(self._there)

    def __len__(self) -> int:
        return len(self._there)


@dataclass(frozen=True, slots=True)
class Reading(Generic[M]):
    """One section that is being read."""

    section: Section[M, Any]
    contents: Contents

    @property
    def report(self) -> Report:
        """Return the report for the findings."""
        return self.contents.documents.report

    @property
    def node(self) -> TreeNode | None:
        """Return the section's contents; None if there are none."""
        node = self.contents.root.get(self.section.name)
        return None if node is None or is_empty(node) else node

    def writer(self, node: TreeNode) -> Path:
        """Return the file that a value was written in."""
        return self.contents.documents.writer(node.span, self.contents.file)

    def key(self, *path: str | int) -> Span:
        """Return the place of a key of the manifest, or of the nearest one above it."""
        return key_span(self.contents.root, path)

    def value(self, *path: str | int) -> Span:
        """Return the place of a value of the manifest, or of the nearest one above it."""
        return value_span(self.contents.root, path)

    def named(self) -> Iterator[tuple[str, Entry]]:
        """Yield the entries by name, after a finding for each bad name, and for sections that were indented too far."""
        for name, entry in named_entries(self.contents.root, (self.section.name, *self.section.at), self.report):
            if self.contents.is_misplaced(self.section, entry):
                self.report.add(misplaced(entry.key, self.section.name))
            else:
                yield name, entry

    def valid(self, model: type[T], name: str, node: TreeNode) -> T | None:
        """Return an entry as an instance of `model`, None after its findings."""
        path, before = (self.section.name, *self.section.at, name), len(self.report.findings)
        read = validate(model, node, path, self.report, self.contents.known)
        if read is None:
            named = self.section.names_in(self.contents.root)
            self.report.findings[before:] = with_namesake(self.report.findings[before:], name, named)
        return read

    def entries(self) -> dict[str, M]:
        """Return the entries without mistakes, by name."""
        found = ((name, self.valid(self.section.entry_type, name, entry.value)) for name, entry in self.named())
        return {name: read for name, read in found if read is not None}

    def readable(self, model: type[T], name: str, node: TreeNode) -> T | None:
        """Return an entry as `valid` does; after its findings, what is left of it: see `salvaged`."""
        return self.valid(model, name, node) or salvaged(model, node, self.contents.known)

    def readable_entries(self) -> dict[str, M]:
        """Return all entries by name, those with mistakes as far as they could be read."""
        found = ((name, self.readable(self.section.entry_type, name, entry.value)) for name, entry in self.named())
        return {name: read for name, read in found if read is not None}

    def whole(self) -> M | None:
        """Return a section with fixed keys; None if it is missing or has mistakes."""
        if self.node is None:
            return None
        known = self.contents.known_in(self.node.span)
        return validate(self.section.model, self.node, (self.section.name,), self.report, known)


def named_entries(root: MappingNode, path: tuple[str, ...], report: Report) -> Iterator[tuple[str, Entry]]:
    """Yield the entries of a section by name, after a finding for each bad name."""
    node = at(root, path)
    if node is None or is_empty(node):
        return
    if is_broken(node):
        return
    if not isinstance(node, MappingNode):
        message = f"'{path[-1]}' must be a map of named entries"
        report.add(WRONG_TYPE.at(node.span, message, label=label_of(node), help=help_with_names(node)))
        return
    for name, entry in node.entries.items():
        if is_valid(Name, name) or validate(Name, replace(entry.key, plain=False), (*path, name), report) is not None:
            yield name, entry
