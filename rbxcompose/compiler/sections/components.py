"""Sections about what runs: components with their types, options and configurations, and their process group."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Set
from dataclasses import replace
from difflib import get_close_matches
from typing import Any

from rbxcompose.base.config import COMPONENT, Config, Name
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import (
    DID_YOU_MEAN,
    SIMILAR,
    Finding,
    Report,
    Span,
    clauses,
    kind,
    nearest,
    replacement,
    suggest,
)
from rbxcompose.base.plugins import BROKEN, LEFT_OUT, BrokenPluginError
from rbxcompose.base.printable import plain
from rbxcompose.manifest.foreign_words import COMPONENTS as FOREIGN_TYPES
from rbxcompose.manifest.foreign_words import CONTROLLERS
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import (
    OPTIONS,
    OVERLAY,
    ROBOT,
    ComponentOptions,
    Contents,
    Reading,
    Renames,
    SetScope,
    WantedComponent,
    Wiring,
)
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode, at, entries_of
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
from rbxcompose.sdk import registry
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.ports import Port

UNKNOWN_TYPE = kind("RBX3004", is_fixable=True)


@dataclass(frozen=True, slots=True)
class ComponentEntry:
    """A component that the user wrote; without `config` if nothing of it could be read.

    It is not sound if the configuration has mistakes: then it is as far as it could be read.
    """

    name: str
    type: str
    options: ComponentOptions
    config: Config | None
    span: Span
    is_sound: bool = True


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    for name, component in contents.of(components).items():
        if component.config is not None:
            place = ("components", name)
            yield WantedComponent(
                name, component.type, component.config, place, component.options, is_sound=component.is_sound
            )


def _models(node: TreeNode) -> Iterator[type[Config]]:
    """Yield the options of every component and the configuration of the type, if that is written down and known."""
    yield ComponentOptions
    if (cls := component_class(node)) is not None:
        yield cls.config_type()


def _rename(renames: Renames, name: str, node: TreeNode) -> TreeNode:
    """Return a component with `connect:` for each port whose own topic is renamed."""
    written = at(node, ("connect",))
    if not isinstance(node, MappingNode) or (written is not None and not isinstance(written, MappingNode)):
        return node
    entries = dict(written.entries) if written else {}
    for port, topic in _own_topics(node).items():
        if port not in entries and (changed := renames.topic(topic)) != topic:
            given = renames.written(topic)
            entries[port] = Entry(ScalarNode(port, given.key_span), ScalarNode(changed, given.span))
    if not entries:
        return node
    span = next(iter(entries.values())).key.span
    key = node.entries["connect"].key if written else ScalarNode("connect", span)
    connect = MappingNode(entries, written.span if written else span)
    return replace(node, entries={**node.entries, "connect": Entry(key, connect)})


def _topics(name: str, node: TreeNode) -> Iterable[str]:
    connect = at(node, ("connect",))
    written = entries_of(connect).items()
    given = {port: entry.value.text for port, entry in written if isinstance(entry.value, ScalarNode)}
    return {**_own_topics(node), **given}.values()


def _own_topics(node: TreeNode) -> dict[str, str]:
    """Return the topics of the ports that a component's class declares; others are not known yet."""
    cls = component_class(node)
    ports = ((name, getattr(cls, name)) for name in dir(cls)) if cls else ()
    return {name: port.topic for name, port in ports if isinstance(port, Port) and port.topic}


def _details(read: Mapping[str, ComponentEntry]) -> dict[str, str]:
    return {name: component_entry.type for name, component_entry in read.items()}


@section(
    "components",
    ComponentOptions,
    order=40,
    names=COMPONENT,
    runs=True,
    wires=True,
    entry="component",
    needs="type",
    scope=SetScope.BARE,
    models=_models,
    rename=_rename,
    topics=_topics,
    components=_components,
    details=_details,
)
def components(reading: Reading[ComponentOptions]) -> dict[str, ComponentEntry]:
    """What runs, by name: a `type`, the settings of that type, and options that every type takes.

    Example:
        components:
          base:
            type: diff_drive_sim
            max_speed: 0.5 m/s            # a setting of the type
            connect:
              odom: wheels/odom           # its port `odom` writes on this topic
          go_to:
            type: go_to
            process: driving
            starts_after: [base]
    """
    found = ((name, _component(reading, name, entry)) for name, entry in reading.named())
    return {name: component_entry for name, component_entry in found if component_entry is not None}


def component_class(node: TreeNode) -> type[Component[Any]] | None:
    """Return the class of a component, if its type is written down and known."""
    written = at(node, ("type",))
    if not isinstance(written, ScalarNode) or written.text not in registry.component_names():
        return None
    try:
        return registry.component_type(written.text)
    except BrokenPluginError:  # reported where the section is read
        return None


def _component(reading: Reading[ComponentOptions], name: str, entry: Entry) -> ComponentEntry | None:
    """Return one component, as far as it could be read; None if its type is missing or unknown."""
    report, known = reading.report, reading.contents.known_in(entry.key.span)
    node, path = entry.value, ("components", name)
    if is_broken(node):
        return None
    if not isinstance(node, MappingNode):
        message = f"component '{name}' must be a map with a 'type:' and its configuration"
        help_text = "write its 'type' and its settings below it, further right"
        report.add(WRONG_TYPE.at(node.span, message, label=label_of(node), help=help_text))
        return None
    # A missing key is reported at the component's name, not at whatever its first key happens to be.
    options_node = _part(node, OPTIONS, entry.key.span)
    options = validate(ComponentOptions, options_node, path, report) or salvaged(ComponentOptions, options_node)
    type_name = _type_name(name, entry, node, report)
    if type_name is None:
        return None
    model = registry.component_type(type_name).config_type()
    keys = [key for key in node.entries if key not in (*OPTIONS, "type")]
    config_node = _part(node, keys, entry.key.span)
    before = len(report.findings)
    sound = validate(model, config_node, path, report, known, also=[*OPTIONS, "type"])
    if sound is None:
        _report_other_type(type_name, {*keys} - {*model.model_fields}, keys, report, before)
    config = sound or salvaged(model, config_node, known)
    return ComponentEntry(
        name, type_name, options or ComponentOptions(), config, entry.key.span, is_sound=sound is not None
    )


def _report_other_type(type_name: str, unknown: Set[str], keys: Collection[str], report: Report, before: int) -> None:
    """Add to the last findings on unknown keys that another type takes all that is written, if only one does."""
    types = [type_ for type_ in _types() if type_ not in registry.PLUGINS.third_party and type_ != type_name]
    fitting = [type_ for type_ in types if {*keys} <= registry.component_type(type_).config_type().model_fields.keys()]
    if not unknown or len(fitting) != 1:
        return
    for index, finding in enumerate(report.findings[before:], before):
        is_meant = finding.code == UNKNOWN_KEY.code and not finding.help.startswith(DID_YOU_MEAN)
        if is_meant and not unknown.isdisjoint(finding.about):
            text = clauses(f"the type '{fitting[0]}' takes this key", finding.help)
            report.findings[index] = replace(finding, help=text)


def _part(node: MappingNode, keys: Collection[str], span: Span) -> MappingNode:
    return MappingNode({name: entry for name, entry in node.entries.items() if name in keys}, span)


def _type_name(name: str, entry: Entry, node: MappingNode, report: Report) -> str | None:
    """Return the type of a component, or None after a finding if there is none of that name."""
    written = node.get("type")
    if written is None:
        misspelt = get_close_matches("type", [key for key in node.entries if key not in OPTIONS], n=1, cutoff=SIMILAR)
        if misspelt:
            key, message = node.entries[misspelt[0]].key, f"unknown key '{misspelt[0]}' in component '{name}'"
            report.add(UNKNOWN_KEY.misspelt(key.span, message, key.text, ["type"]))
        elif (other := _as_type(node)) is not None:
            key, meant = other
            message, fix = f"unknown key '{key.text}' in component '{name}'", replacement(key.span, key.text, "type")
            report.add(UNKNOWN_KEY.at(key.span, message, help=f"write 'type: {meant.text}'", fix=fix))
        else:
            near = nearest(name, types := _listed())
            help_text = f"write 'type: {near[0]}' below it, or another type" if near else suggest(name, types, "types")
            report.add(MISSING_KEY.at(entry.key.span, f"component '{name}' needs the key 'type'", help=help_text))
        return None
    if not isinstance(written, ScalarNode):
        report.add(WRONG_TYPE.at(written.span, "'type' must be the name of a type", label=label_of(written)))
        return None
    if is_broken(written):
        return None
    if text := registry.PLUGINS.overshadowed(written.text):
        report.add(LEFT_OUT.at(written.span, text))
    if written.text not in registry.component_names():
        report.add(_unknown_type(name, written))
        return None
    try:
        registry.component_type(written.text)
    except BrokenPluginError as error:
        report.add(BROKEN.at(written.span, str(error)))
        return None
    return written.text


def _as_type(node: MappingNode) -> tuple[ScalarNode, ScalarNode] | None:
    """Return the key and the value of a component without a type that has one under another key: `platform: go_to`."""
    found = [
        (entry.key, entry.value)
        for key, entry in node.entries.items()
        if key not in OPTIONS and isinstance(entry.value, ScalarNode) and entry.value.text in registry.component_names()
    ]
    return found[0] if len(found) == 1 else None


def _unknown_type(name: str, written: ScalarNode) -> Finding:
    shown = plain(written.text, 60)
    message = f"component '{name}' has a type that does not exist: '{shown}'"
    theirs = written.text.rpartition("/")[-1]
    if ours := FOREIGN_TYPES.get(theirs):
        return UNKNOWN_TYPE.at(written.span, message, help=f"{DID_YOU_MEAN} '{ours}'?")
    if ours := CONTROLLERS.get(theirs):
        return UNKNOWN_TYPE.at(written.span, message, help=f"write it below 'controllers', with the type '{ours}'")
    finding = UNKNOWN_TYPE.misspelt(written.span, message, written.text, _types(), "types")
    if finding.help.startswith(DID_YOU_MEAN) or not is_valid(Name, written.text):
        return finding
    elsewhere = f"if a package brings it, install that; 'rbxcompose new component {shown}' begins one of your own"
    return replace(finding, help="; ".join(filter(None, (finding.help, elsewhere))))


def _listed() -> list[str]:
    """Return the names of the types that users list, and of those of other packages."""
    foreign = registry.PLUGINS.third_party
    return [type_ for type_ in _types() if type_ in foreign or not registry.component_type(type_).made_by]


def _types() -> list[str]:
    """Return the names of all types, first those that users list; types of other packages are not imported for it."""
    names, foreign = registry.component_names(), registry.PLUGINS.third_party
    return sorted(names, key=lambda name: name not in foreign and bool(registry.component_type(name).made_by))


@section("process", Name, order=105, files=(ROBOT, OVERLAY))
def process(reading: Reading[str]) -> str | None:
    """The process group of all components that do not name their own, also of those that every robot has.

    Without it, each type has its default. In a single process, the patrol robot takes half of the processor and three
    quarters of the memory, but a crash of one component stops all: write `world` for a simulated robot, which then goes
    down, as simulated truth is lost, and `robot` for a real one, whose process then starts again.

    Example:
        process: world
    """
    return validate(str, reading.node, ("process",), reading.report) if reading.node is not None else None
