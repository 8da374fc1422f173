"""What a part brings, under the names that it has in the file that includes it.

Components, places, values, missions and analyzers of the instance `head` get `head_` in front, and what the part says
of them follows. Topics get nothing in front: a mux is named after its topic, so it keeps its name; `connect` gives a
topic of the part another name, and with it a mux, or one of its inputs. A name that the part itself does not have is
one of the file that includes it. What holds `${` is filled in later and stays as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import Any, get_args

from pydantic import BaseModel

from rbxcompose.config import Place
from rbxcompose.findings import Span
from rbxcompose.manifest.tree import Entry, Mapping, Node, Scalar, Sequence, at
from rbxcompose.plugins import BrokenPluginError
from rbxcompose.sdk import registry
from rbxcompose.sdk.ports import Port

Rename = Callable[[str], str]
_NAMED = ("components", "places", "values", "missions")


@dataclass(frozen=True, slots=True)
class Topic:
    """Another name for a topic of a part, and where it is written."""

    name: str
    span: Span
    key_span: Span


@dataclass(slots=True)
class Renaming:
    """How the names of one instance change; `used` are the topics of `connect` that the part has."""

    prefix: str
    connect: dict[str, Topic]
    own: dict[str, frozenset[str]]  # by section
    used: set[str] = field(default_factory=set)

    @classmethod
    def of(cls, prefix: str, connect: dict[str, Topic], roots: Iterable[Mapping]) -> Renaming:
        """Return the renaming for what `roots` bring: the file of a part and all that it includes."""
        sections = (*_NAMED, "muxes")
        found: dict[str, set[str]] = {section: set() for section in sections}
        for root in roots:
            for section in sections:
                found[section] |= set(names_in(root, section))
        return cls(prefix, connect, {section: frozenset(names) for section, names in found.items()})

    def root(self, root: Mapping) -> Mapping:
        """Return the sections of a part under their new names."""
        changed = {
            "components": lambda node: self._named(node, self._component),
            "places": lambda node: self._named(node, lambda place: place),
            "values": lambda node: self._named(node, self._value),
            "missions": lambda node: self._named(node, self._mission),
            "muxes": self._muxes,
            "diagnostics": self._diagnostics,
        }
        entries = {}
        for name, entry in root.entries.items():
            change = changed.get(name)
            entries[name] = Entry(entry.key, change(entry.value)) if change else entry
        return replace(root, entries=entries)

    def topic(self, topic: str) -> str:
        """Return the name that a topic of the part has outside; an input of a mux follows its mux."""
        if found := self.connect.get(topic):
            self.used.add(topic)
            return found.name
        above, slash, name = topic.rpartition("/")
        if slash and above in self.own["muxes"] and above in self.connect:
            return f"{self.topic(above)}/{name}"
        return topic

    def component(self, name: str) -> str:
        """Return the new name of a component or a mux; `component.port` keeps its port."""
        component, dot, port = name.partition(".")
        if component in self.own["components"]:
            return f"{self.prefix}{component}{dot}{port}"
        return f"{self.topic(component)}{dot}{port}" if component in self.own["muxes"] else name

    def name_in(self, section: str) -> Rename:
        """Return what a name of one of the part's sections becomes."""
        return lambda name: f"{self.prefix}{name}" if name in self.own[section] else name

    def any_name(self, name: str) -> str:
        """Return what a word becomes that may name anything of the part: a value given by `with:`."""
        changed = self.component(name)
        for section in ("places", "values", "missions"):
            changed = self.name_in(section)(name) if changed == name else changed
        return changed

    def values(self, given: Mapping) -> Mapping:
        """Return the values that a part gives to one that it includes."""
        entries = {name: Entry(one.key, self.texts(one.value, self.any_name)) for name, one in given.entries.items()}
        return replace(given, entries=entries)

    def texts(self, node: Node, change: Rename) -> Node:
        """Return a node with every text below it changed, but for those that are filled in later."""
        match node:
            case Scalar(text=text):
                changed = text if "${" in text else change(text)
                return node if changed == text else replace(node, text=changed)
            case Sequence(items=items):
                return replace(node, items=tuple(self.texts(item, change) for item in items))
            case Mapping(entries=entries):
                return replace(node, entries={n: Entry(e.key, self.texts(e.value, change)) for n, e in entries.items()})

    def topics(self, node: Node, above: str = "") -> Node:
        """Return a map whose keys are topics (below `above`, if given) with these changed; what is no map stays."""
        if not isinstance(node, Mapping):
            return node
        entries = {}
        for name, entry in node.entries.items():
            topic = f"{above}{name}"
            changed = self.topic(topic).removeprefix(self.topic(above.removesuffix("/")) + "/" if above else "")
            # A name that is wrong is shown where it was given.
            span = self.connect[topic].span if topic in self.connect else entry.key.span
            entries[changed] = Entry(replace(entry.key, text=changed, span=span), entry.value)
        return replace(node, entries=entries)

    def _named(self, node: Node, change: Callable[[Node], Node]) -> Node:
        if not isinstance(node, Mapping):
            return node
        entries = {
            f"{self.prefix}{name}": Entry(replace(entry.key, text=f"{self.prefix}{name}"), change(entry.value))
            for name, entry in node.entries.items()
        }
        return replace(node, entries=entries)

    def _component(self, node: Node) -> Node:
        if not isinstance(node, Mapping):
            return node
        node = _with(node, "starts_after", lambda after: self.texts(after, self.component))
        node = _with(node, "connect", lambda connect: self.texts(connect, self.topic))
        cls = _type(node)
        return self._places_of(cls.config_type(), self._connected(node, _ports(cls))) if cls else node

    def _connected(self, node: Mapping, ports: dict[str, Port[Any]]) -> Mapping:
        """Return a component with `connect:` for each port whose own topic gets another name."""
        written = node.get("connect")
        if written is not None and not isinstance(written, Mapping):
            return node
        entries = dict(written.entries) if written else {}
        for name, port in ports.items():
            if name not in entries and (changed := self.topic(port.topic)) != port.topic:
                given = self.connect.get(port.topic) or self.connect[port.topic.rpartition("/")[0]]
                entries[name] = Entry(Scalar(name, given.key_span), Scalar(changed, given.span))
        if not entries:
            return node
        span = next(iter(entries.values())).key.span
        connect = Mapping(entries, written.span if written else span)
        key = node.entries["connect"].key if written else Scalar("connect", span)
        return replace(node, entries={**node.entries, "connect": Entry(key, connect)})

    def _places_of(self, model: type[BaseModel], node: Mapping) -> Mapping:
        """Return a map with the names of the part's places changed where `model` takes the name of a place."""
        for name, model_field in model.model_fields.items():
            if _takes_place(model_field.annotation):
                node = _with(node, model_field.alias or name, lambda value: self.texts(value, self.name_in("places")))
        return node

    def _value(self, node: Node) -> Node:
        if isinstance(node, Scalar):
            return self.texts(node, self.component)
        if not isinstance(node, Mapping):
            return node
        node = _with(node, "port", lambda port: self.texts(port, self.component))
        return _with(node, "topic", lambda topic: self.texts(topic, self.topic))

    def _mission(self, node: Node) -> Node:
        if not isinstance(node, Mapping):
            return node
        return _with(node, "with", lambda given: self.texts(given, self.any_name))

    def _muxes(self, node: Node) -> Node:
        if not isinstance(node, Mapping):
            return node
        muxes = {mux: Entry(entry.key, self._mux(mux, entry.value)) for mux, entry in node.entries.items()}
        return self.topics(replace(node, entries=muxes))

    def _mux(self, mux: str, node: Node) -> Node:
        if not isinstance(node, Mapping):
            return node
        node = _with(node, "inputs", lambda inputs: self._each(inputs, lambda one: _with(one, "from", self._source)))
        for key in ("inputs", "locks"):
            node = _with(node, key, lambda named: self.topics(named, f"{mux}/"))
        return node

    def _source(self, node: Node) -> Node:
        return self.texts(node, self.component)

    def _each(self, node: Node, change: Callable[[Mapping], Node]) -> Node:
        if not isinstance(node, Mapping):
            return node
        entries = {
            name: Entry(entry.key, change(entry.value) if isinstance(entry.value, Mapping) else entry.value)
            for name, entry in node.entries.items()
        }
        return replace(node, entries=entries)

    def _diagnostics(self, node: Node) -> Node:
        analyzers = at(node, ("analyzers",))
        if not isinstance(node, Mapping) or not isinstance(analyzers, Mapping):
            return node
        return _with(node, "analyzers", lambda named: self._named(self._each(named, self._analyzer), lambda one: one))

    def _analyzer(self, node: Mapping) -> Node:
        return _with(_with(node, "match", self._patterns), "expected", self._patterns)

    def _patterns(self, node: Node) -> Node:
        """Return a list of names and patterns; one that also matches muxes of the part names them beside it."""
        if not isinstance(node, Sequence):
            return node
        items: list[Node] = []
        for item in node.items:
            changed = self._pattern(item.text) if isinstance(item, Scalar) and "${" not in item.text else []
            items += [replace(item, text=text) for text in changed] if isinstance(item, Scalar) and changed else [item]
        return replace(node, items=tuple(items))

    def _pattern(self, pattern: str) -> list[str]:
        matched = [self.topic(mux) for mux in sorted(self.own["muxes"]) if fnmatchcase(mux, pattern)]
        is_own = any(fnmatchcase(name, pattern) for name in self.own["components"])
        return [f"{self.prefix}{pattern}", *matched] if is_own else matched


def names_in(root: Mapping, section: str) -> Iterable[str]:
    """Return the names in a section of a tree."""
    node = root.get(section)
    return node.entries if isinstance(node, Mapping) else ()


def topics_of(roots: Iterable[Mapping]) -> set[str]:
    """Return the topics that trees have, as `connect:` of an instance may name them."""
    found: set[str] = set()
    for root in roots:
        for name in names_in(root, "components"):
            connect, cls = at(root, ("components", name, "connect")), _type(at(root, ("components", name)))
            ports = {port: one.topic for port, one in _ports(cls).items()} if cls else {}
            for port, entry in connect.entries.items() if isinstance(connect, Mapping) else ():
                ports |= {port: entry.value.text} if isinstance(entry.value, Scalar) else {}
            found |= set(ports.values())
        for mux in names_in(root, "muxes"):
            found.add(mux)
            for key in ("inputs", "locks"):
                node = at(root, ("muxes", mux, key))
                found |= {f"{mux}/{name}" for name in (node.entries if isinstance(node, Mapping) else ())}
    return found


def _type(component: Node | None) -> type[Any] | None:
    """Return the class of a component, if its type is written down and known."""
    written = at(component, ("type",)) if component else None
    if not isinstance(written, Scalar) or written.text not in registry.component_names():
        return None
    try:
        return registry.component_type(written.text)
    except BrokenPluginError:  # told where the section is read
        return None


def _with(node: Mapping, key: str, change: Callable[[Node], Node]) -> Mapping:
    """Return a map with the value of `key` changed, if it has it."""
    if key not in node.entries:
        return node
    entry = node.entries[key]
    return replace(node, entries={**node.entries, key: Entry(entry.key, change(entry.value))})


def _ports(cls: type[Any]) -> dict[str, Port[Any]]:
    """Return the ports that a class declares; those that depend on its configuration are not known yet."""
    return {name: port for name in dir(cls) if isinstance(port := getattr(cls, name), Port) and port.topic}


def _takes_place(annotation: object) -> bool:
    """Tell whether a field takes the name of a place, or several of them."""
    return annotation is Place or any(map(_takes_place, get_args(annotation)))
