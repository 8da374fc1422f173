"""Rename what a part brings to its names in the file that includes it.

Names of the instance `head` get the prefix `head_`, and the part's references to them follow. Topics get no prefix: a
mux is named after its topic, so it keeps its name; `connect` renames a topic of the part, and with it a mux or one of
its inputs. A name that the part itself lacks belongs to the file that includes it. Text with `${` is filled in later
and stays unchanged. The descriptor of a section defines its names and its references to names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import field, replace
from typing import Any

from rbxcompose.dataclass import dataclass
from rbxcompose.manifest.registry import naming, section_named, sections
from rbxcompose.manifest.renamer import RenamedTopic
from rbxcompose.manifest.section import Section
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode, at
from rbxcompose.references import ANYTHING, COMPONENT, PORT, PREFIXED, TOPIC

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
    def of(cls, prefix: str, connect: dict[str, RenamedTopic], roots: Iterable[MappingNode]) -> Renaming:
        """Return the renaming for `roots`: the file of a part and all that it includes."""
        trees = list(roots)
        named = [one for one in sections() if one.names and one.is_composed]
        own = {one.name: frozenset(name for root in trees for name in one.names_in(root)) for one in named}
        defines = frozenset(kind for one in sections() for kind in one.defines if any(one.name in it for it in trees))
        return cls(prefix, connect, own, defines)

    @property
    def running(self) -> frozenset[str]:
        """Return the names of all that the part runs."""
        return frozenset(name for one in naming(COMPONENT) for name in self.own[one.name])

    def root(self, root: MappingNode) -> MappingNode:
        """Return the sections of a part under their new names."""
        entries = {}
        for name, entry in root.entries.items():
            section = section_named(name)
            entries[name] = Entry(entry.key, self._section(section, entry.value)) if section else entry
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
        for section in naming(COMPONENT if kind == PORT else kind):
            if head in self.own.get(section.name, ()):
                return f"{self._new(section, head)}{dot}{rest}"
        return name

    def any_name(self, name: str) -> str:
        """Return the new form of a word that may name anything in the part: a value given by `with:`."""
        kinds = (one.names for one in sections() if one.is_map and one.is_composed)
        changed = (self.name(kind, name) for kind in (COMPONENT, *kinds, *PREFIXED))
        return next((one for one in changed if one != name), name)

    def values(self, given: MappingNode) -> MappingNode:
        """Return the renamed values that a part gives to one that it includes."""
        entries = {name: Entry(one.key, self.texts(one.value, self.any_name)) for name, one in given.entries.items()}
        return replace(given, entries=entries)

    def texts(self, node: TreeNode, change: Rename) -> TreeNode:
        """Return a node with every text below it changed, except those that are filled in later."""
        match node:
            case ScalarNode(text=text):
                changed = text if "${" in text else change(text)
                return node if changed == text else replace(node, text=changed)
            case SequenceNode(items=items):
                return replace(node, items=tuple(self.texts(item, change) for item in items))
            case MappingNode(entries=entries):
                return replace(node, entries={n: Entry(e.key, self.texts(e.value, change)) for n, e in entries.items()})

    def topics(self, node: TreeNode, above: str = "") -> TreeNode:
        """Return a map with its keys renamed as topics (below `above`, if given); other nodes stay unchanged."""
        if not isinstance(node, MappingNode):
            return node
        entries = {}
        for name, entry in node.entries.items():
            topic = f"{above}{name}"
            changed = self.topic(topic).removeprefix(self.topic(above.removesuffix("/")) + "/" if above else "")
            # A wrong name is reported where it was given.
            span = self.connect[topic].span if topic in self.connect else entry.key.span
            entries[changed] = Entry(replace(entry.key, text=changed, span=span), entry.value)
        return replace(node, entries=entries)

    def _is_own_topic(self, topic: str) -> bool:
        return any(one.has_topics and topic in self.own.get(one.name, ()) for one in sections())

    def _new(self, section: Section[Any, Any], name: str) -> str:
        if section.has_topics:
            return self.topic(name)
        instance = self.prefix.removesuffix("_")
        if section.repeats or not (instance == name or instance.endswith(f"_{name}")):
            return f"{self.prefix}{name}"
        return instance

    def _section(self, section: Section[Any, Any], node: TreeNode) -> TreeNode:
        node = section.with_references(node, lambda kind, one: self.texts(one, lambda text: self.name(kind, text)))
        if section.at and isinstance(node, MappingNode):
            return _with(node, section.at[0], lambda named: self._named(section, named))
        return self._named(section, node) if section.names else node

    def _named(self, section: Section[Any, Any], node: TreeNode) -> TreeNode:
        if not isinstance(node, MappingNode):
            return node
        values = {name: section.rename(self, name, entry.value) for name, entry in node.entries.items()}
        changed = {name: Entry(entry.key, values[name]) for name, entry in node.entries.items()}
        if section.has_topics:
            return self.topics(replace(node, entries=changed))
        new = {name: self._new(section, name) for name in changed}
        entries = {new[name]: Entry(replace(one.key, text=new[name]), one.value) for name, one in changed.items()}
        return replace(node, entries=entries)


def topics_of(roots: Iterable[MappingNode]) -> set[str]:
    """Return the topics in trees that `connect:` of an instance may name."""
    return {
        topic
        for root in roots
        for section in sections()
        for name in section.names_in(root)
        if (node := at(root, (section.name, *section.at, name))) is not None
        for topic in section.topics(name, node)
    }


def _with(node: MappingNode, key: str, change: Callable[[TreeNode], TreeNode]) -> MappingNode:
    """Return a map with the value of `key` changed, if it has that key."""
    if key not in node.entries:
        return node
    entry = node.entries[key]
    return replace(node, entries={**node.entries, key: Entry(entry.key, change(entry.value))})
