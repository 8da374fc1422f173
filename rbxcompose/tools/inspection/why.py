"""Why a value of the robot is as it is: where it is written, what it replaced, what it means."""

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from typing import Any

from rbxcompose.base.config import COMPONENT
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Span, kind
from rbxcompose.base.printable import plain
from rbxcompose.base.units import UNITS, Dimension, Quantity, UnitError, format_number, parse_quantity, to_si
from rbxcompose.compiler.composition.layers import in_section
from rbxcompose.compiler.composition.overlay import SET
from rbxcompose.compiler.composition.robot_manifest import ROBOT_LAYER, HistoryStep, RobotManifest
from rbxcompose.compiler.model.robot import PortEnd, Robot, RobotComponent, resolve
from rbxcompose.compiler.plan.model import BusPlan
from rbxcompose.compiler.schema.guide import Guide
from rbxcompose.compiler.schema.robot import robot_schema
from rbxcompose.compiler.sections.composition import include
from rbxcompose.domains.muxes.sections.muxes import muxes
from rbxcompose.manifest.registry import naming, robot_keys
from rbxcompose.manifest.section import SetScope
from rbxcompose.manifest.tree import KeyPath, MappingNode, ScalarNode, SequenceNode, TreeNode, at, key_span
from rbxcompose.missions.engine.world import show as show_value
from rbxcompose.missions.program.parts import Input
from rbxcompose.sdk.ports import Calls, CallsAction, In, Looks, Out, Serves, ServesAction, ServesTopic
from rbxcompose.tools.inspection.diagram import does, keys_of, qos_of
from rbxcompose.tools.inspection.origin import Origin, as_data, expand_below, indexed, origin_of, placed, shown

NO_SUCH_PATH = kind("RBX9011")
LABEL = 15  # width of the labels
_OTHER = {  # the first one that matches a port counts
    ServesTopic: (Out, "ordered by"),
    Out: (In, "read by"),
    In: (Out, "sent by"),
    Serves: (Calls, "called by"),
    Calls: (Serves, "served by"),
    ServesAction: (CallsAction, "asked by"),
    CallsAction: (ServesAction, "served by"),
}
_ARGUMENT = re.compile(r"\bargs\.([a-z][a-z0-9_]*)")
_MEASURED = ("args", "missions", "include")  # sections in which only the value itself shows its dimension
_schema = lru_cache(maxsize=1)(robot_schema)  # one robot is asked about many values


def path_of(robot: Robot, text: str) -> KeyPath:
    """Return the path from the root that a text means; list items are counted from 0."""
    names: list[str | int] = list(text.strip().split("."))
    manifest = robot.manifest
    if names[0] not in robot_keys():
        names.insert(0, _section_of(manifest, str(names[0])))
    return indexed(tree_of(manifest, tuple(names)), names)


def _section_of(manifest: RobotManifest, name: str) -> str:
    """Return the section that names something that runs; that of the components if no section does."""
    running = sorted(naming(COMPONENT), key=lambda one: one.scope is SetScope.BARE)
    return next(
        (declaration.name for declaration in running if name in declaration.names_in(manifest.root)), running[-1].name
    )


def short(path: KeyPath) -> str:
    """Return a path as people write it."""
    return ".".join(map(str, path[1:] if path[0] == "components" and len(path) > 1 else path))


def tree_of(manifest: RobotManifest, path: KeyPath) -> MappingNode:
    """Return the tree that a path belongs to: the section `include` is read before the rest, and kept beside it."""
    return manifest.include if path[:1] == (include.name,) else manifest.root


def found_at(manifest: RobotManifest, path: KeyPath) -> TreeNode | None:
    """Return the node at a path of the composed robot, or None."""
    return at(tree_of(manifest, path), path)


def no_such_path(robot: Robot, path: KeyPath, guide: Guide) -> Finding:
    """Return the finding for a path that does not exist, with the probable meaning of its first wrong name."""
    if path[0] == "profiles":
        return NO_SUCH_PATH.at(None, "profiles have no value of their own", help="'--profile NAME' applies one")
    length = next(n for n in range(1, len(path) + 1) if not is_known(robot.manifest, guide, path[:n]))
    above, name = path[: length - 1], str(path[length - 1])
    node = found_at(robot.manifest, above)
    valid = {*guide.keys(above), *(node.entries if isinstance(node, MappingNode) else ())}
    place = f"'{short(above)}'" if above else ""
    if above in ((), ("components",)):
        place = f"robot '{robot.manifest.name}'"
        valid |= {*robot.components, *(key for key in robot_keys() if key in robot.manifest.root)}
    elif len(above) == 2 and str(above[1]) in robot.components:
        valid |= {end.name for end in robot.components[str(above[1])].ends}
    if isinstance(node, SequenceNode):
        valid = {str(index) for index in range(len(node.items))}
    message = f"{place} has no '{plain(name, 60)}'"
    if above == ("components",) and (hint := in_section([str(key) for key in path[1:]], robot.manifest.root)):
        return NO_SUCH_PATH.at(None, message, help=hint)
    return NO_SUCH_PATH.misspelt(None, message, name, sorted(valid), "what it has")


def is_known(manifest: RobotManifest, guide: Guide, path: KeyPath) -> bool:
    """Return whether a path exists, or is a key that could be written there."""
    return found_at(manifest, path) is not None or str(path[-1]) in guide.keys(path[:-1])


@dataclass(frozen=True, slots=True)
class Layer:
    """What one layer wrote; None if it removed the value."""

    name: str
    value: str | None
    span: Span

    @property
    def place(self) -> str:
        """Return the place where it is written; empty for the command line."""
        return "" if self.span.file == SET else str(self.span)


@dataclass(frozen=True, slots=True)
class ArgumentSource:
    """An argument that a value was filled in from; `below` are the layers whose values it replaced."""

    name: str
    value: str
    origin: Origin | None
    below: tuple[Layer, ...] = ()


@dataclass(frozen=True, slots=True)
class PathAnswer:
    """Everything known about one path; the last of `layers` is in effect."""

    path: str
    value: str
    about: str = ""
    dimension: Dimension | None = None
    si: float | None = None
    layers: tuple[Layer, ...] = ()
    sources: tuple[ArgumentSource, ...] = ()
    is_default: bool = False
    hints: tuple[tuple[str, str], ...] = ()  # a label and a text
    place: str = ""
    body: str = ""
    node: TreeNode | None = None

    def text(self) -> str:
        """Return the answer as text for people."""
        lines = [f"{self.path} = {plain(self.value)}", *([f"  {self.about}"] if self.about else [])]
        lines += [f"  {label:<{LABEL}}{text}".rstrip() for label, text in self._rows()]
        if self.body:
            lines += ["", *(f"  {line}" for line in self.body.splitlines())]
        return "\n".join(lines)

    def _rows(self) -> Iterator[tuple[str, str]]:
        if self.si is not None and self.dimension is not None:
            yield "in SI", f"{format_number(self.si)} {si_unit(self.dimension)}".rstrip() + f", {self.dimension.phrase}"
        if self.place:
            yield "where", self.place
        match self.layers:
            case ():
                pass
            case (only,):
                written = f", as {plain(only.value)}" if only.value not in (None, self.value) else ""
                yield "where", f"{_where(only)}{written}"
            case _:
                for index, row in enumerate(self._layer_rows()):
                    yield "" if index else "layers", row
        for index, source in enumerate(self.sources):
            place = f"  {source.origin.comment}" if source.origin else ""
            is_or_has = "=" if source.origin else "has"
            yield "" if index else "from", f"{source.name} {is_or_has} {plain(source.value)}{place}"
            for layer in reversed(source.below):
                origin = Origin(layer.span, layer.name)
                yield "", f"  instead of {plain(layer.value or 'nothing')}  {origin.comment}"
        yield from self.hints

    def _layer_rows(self) -> Iterator[str]:
        rows = [(layer.name, layer.value or "(removed)", layer.place) for layer in self.layers]
        widths = [max(len(row[column]) for row in rows) for column in range(2)]
        for row in rows:
            holds = "  <- holds" if row is rows[-1] else ""
            yield f"{row[0]:<{widths[0]}}  {plain(row[1]):<{widths[1]}}  {row[2]}".rstrip() + holds

    def data(self) -> dict[str, Any]:
        """Return the answer as data for programs."""
        return {
            "path": self.path,
            "value": as_data(self.node) if self.node is not None else self.value,
            "about": self.about,
            "si": self.si,
            "unit": si_unit(self.dimension) if self.dimension else "",
            "is_default": self.is_default,
            "layers": _as_data(self.layers),
            "filled_in_from": [
                {
                    "name": source.name,
                    "value": source.value,
                    **(placed(source.origin.span) if source.origin else {}),
                    "below": _as_data(source.below),
                }
                for source in self.sources
            ],
            "more": dict(self.hints),
        }


def _as_data(layers: tuple[Layer, ...]) -> list[dict[str, Any]]:
    return [{"layer": layer.name, "value": layer.value, **placed(layer.span)} for layer in layers]


def _where(layer: Layer) -> str:
    return ", ".join(part for part in (layer.place, layer.name if layer.name != ROBOT_LAYER else "") if part)


def si_unit(dimension: Dimension) -> str:
    """Return the unit in which values of a dimension are kept, nothing if it has none of its own."""
    units = (unit.name for unit in UNITS.values() if unit.dimension == dimension and unit.to_si(1.0) == 1.0)
    return next(units, "")


def why_port(robot: Robot, path: KeyPath) -> PathAnswer | None:
    """Return what is known about a component (`transforms`) or its port (`go_to.cmd_vel`), None if there is none."""
    name, *rest = [str(key) for key in (path[1:] if path[0] in ("components", "muxes") else path)] or [""]
    component = robot.components.get(name)
    if component is None or len(rest) > 1:
        return None
    if not rest:
        about = (component.cls.__doc__ or "").strip().partition("\n")[0]
        is_written = at(robot.manifest.root, component.path) is not None
        place = str(robot.component_span(name)) if is_written else "every robot runs it"
        return PathAnswer(name, f"type {component.type_name}", about, hints=(("where", place),))
    end = component.end(rest[0])
    return _port(robot, component, end) if end else None


def _port(robot: Robot, component: RobotComponent, end: PortEnd) -> PathAnswer:
    path = f"{end.instance}.{end.name}"
    if isinstance(end.port, Looks):
        return PathAnswer(path, f"looks up '{end.port.source}' in '{end.port.target}'")
    qos = qos_of(end.port)
    value = f"{does(end.port)} {end.type_name} at {end.topic}" + (f", as {qos}" if qos else "")
    bus = robot.manifest.bus
    keys = keys_of(end.port, end.topic, BusPlan(bus.domain, bus.namespace or "", bus.port, bus.wire, bus.router))
    hints = [("because", _reason(robot, component, end)), _others(robot, end)]
    return PathAnswer(path, value, hints=(*hints, *((label if len(keys) > 1 else "key", key) for label, key in keys)))


def _reason(robot: Robot, component: RobotComponent, end: PortEnd) -> str:
    namespace = robot.manifest.bus.namespace or ""
    for mux, entry in robot.manifest.contents.of(muxes).items():
        for name, source in entry.inputs.items():
            is_taken = (source.source or "").partition(".")[0] == component.name and isinstance(end.port, Out)
            if is_taken and end.topic == resolve(source.topic or f"{mux}/{name}", namespace):
                place = robot.value("muxes", mux, "inputs", name, "from")
                return f"mux '{mux}' takes it as its input '{name}' ({place})"
    connected = (*component.path, "connect", end.name)
    if at(robot.manifest.root, connected) is not None:
        return f"'connect' says so ({robot.value(*connected)})"
    if component.path[:1] == ("muxes",):
        return f"a mux and its inputs are named so ({robot.component_span(component.name)})"
    if namespace and not end.port.topic.startswith("/"):
        return f"that is its own name in the namespace '{namespace}' ({robot.value('bus', 'namespace')})"
    connection = robot.connection([(end, "...")])
    return "that is its own name" + (f"; {connection} gives it another one" if connection else "")


def _others(robot: Robot, end: PortEnd) -> tuple[str, str]:
    other, words = next(pair for kind, pair in _OTHER.items() if isinstance(end.port, kind))
    names = [
        f"{one.instance}.{one.name}" for one in robot.ends if one.topic == end.topic and isinstance(one.port, other)
    ]
    outside = "anything outside" if isinstance(end.port, In) and end.port.is_open else "nothing here"
    return words, ", ".join(names) or outside


def why(robot: Robot, text: str) -> PathAnswer | Finding:
    """Return everything known about a path of the robot, written as for `--set`, or about a port: `go_to.cmd_vel`."""
    path = path_of(robot, text)
    node = found_at(robot.manifest, path)
    guide = _guide(robot.manifest, path)
    if isinstance(node, MappingNode) and path[0] == "args" and len(path) == 2:
        return _argument_in_effect(robot, guide, path, node)
    if node is not None:
        return _written(robot, guide, path, node)
    if removed := _removed(robot.manifest, path):
        return PathAnswer(short(path), "nothing", _about(robot, guide, path), layers=removed)
    if path[0] != "profiles" and (answer := _unwritten(robot, guide, path)):
        return answer
    return why_port(robot, path) or no_such_path(robot, path, guide)


def _guide(manifest: RobotManifest, path: KeyPath) -> Guide:
    types = {name: entry.type for name, entry in manifest.components.items()}
    return Guide(_schema(frozenset(types.values())), tree_of(manifest, path), types)


def _written(robot: Robot, guide: Guide, path: KeyPath, node: TreeNode) -> PathAnswer:
    about, place = _about(robot, guide, path), origin_of(robot.manifest, path, node)
    if isinstance(node, MappingNode) and node.entries:
        body = expand_below(robot.manifest, path, node, dict(_defaults(guide, path, node)))
        where = key_span(tree_of(robot.manifest, path), path)
        return PathAnswer(short(path), _kind(path, node), about, place=str(where), body=body, node=node)
    dimension = _dimension(guide, path, node)
    return PathAnswer(
        short(path),
        shown(node),
        about,
        dimension=dimension,
        si=_si(node, dimension),
        layers=tuple(_layer(step) for step in robot.manifest.history.of(path)) or (Layer("", shown(node), place.span),),
        sources=tuple(_sources(robot.manifest, path)),
        node=node,
    )


def _argument_in_effect(robot: Robot, guide: Guide, path: KeyPath, declared: MappingNode) -> PathAnswer:
    """Return the value of an argument: its default, or what a layer above has replaced it with."""
    written = {name: shown(entry.value) for name, entry in declared.entries.items()}
    limits = [f"{words} {written[key]}" for key, words in (("min", "at least"), ("max", "at most")) if key in written]
    limits += [f"one of {written['choices']}"] if "choices" in written else []
    hints = (("type", ", ".join([written.get("type", "nothing"), *limits])), ("to set it", _to_set(path)))
    value = declared.get("default")
    if value is None:
        place = key_span(robot.manifest.root, path)
        return PathAnswer(short(path), "nothing", written.get("about", ""), place=str(place), hints=hints)
    answer = _written(robot, guide, (*path, "default"), value)
    return replace(answer, path=short(path), about=written.get("about", ""), hints=hints)


def _kind(path: KeyPath, node: MappingNode) -> str:
    type_ = node.get("type")
    if path[0] == "components" and len(path) == 2 and type_ is not None:
        return f"a component of type {shown(type_)}"
    return "a map with one key" if len(node.entries) == 1 else f"a map with {len(node.entries)} keys"


def _about(robot: Robot, guide: Guide, path: KeyPath) -> str:
    """Return the purpose of a key, as its type describes it."""
    if len(path) == 2 and path[0] == "components" and str(path[1]) in robot.components:
        return (robot.components[str(path[1])].cls.__doc__ or "").strip().partition("\n")[0]
    return guide.describe(path)


def _layer(step: HistoryStep) -> Layer:
    name = SET if step.layer.strip("'") == SET else step.layer
    return Layer(name, None if step.node is None else shown(step.node), step.span)


def _removed(manifest: RobotManifest, path: KeyPath) -> tuple[Layer, ...]:
    """Return the layers of a removed value, the one that removed it last."""
    return tuple(_layer(step) for step in manifest.history.of(path))


def _dimension(guide: Guide, path: KeyPath, node: TreeNode) -> Dimension | None:
    if not isinstance(node, ScalarNode):
        return None
    if isinstance(node.filled, Quantity):
        return node.filled.dimension
    if path[0] in _MEASURED and node.filled is None and node.plain:
        try:
            return parse_quantity(node.text).dimension
        except UnitError:
            return None
    return guide.value(path).dimension


def _si(node: TreeNode, dimension: Dimension | None) -> float | None:
    """Return a quantity in SI; None if it is not one, or is wrong, which `check` reports."""
    if dimension is None or not isinstance(node, ScalarNode):
        return None
    try:
        return to_si(node.filled if node.filled is not None else node.text, dimension)
    except UnitError:
        return None


def _sources(manifest: RobotManifest, path: KeyPath) -> Iterator[ArgumentSource]:
    """Yield the arguments that a value was filled in from, each followed by those it was itself given."""
    steps = manifest.history.of(path)
    written = steps[-1].node if steps else None
    if not isinstance(written, ScalarNode) or "${" not in written.text:
        return
    for name in _ARGUMENT.findall(written.text):
        yield from _argument(manifest, name, written.scope)


def _argument(manifest: RobotManifest, name: str, scope: str) -> Iterator[ArgumentSource]:
    path: KeyPath = ("include", scope, "with", name) if scope else ("args", name, "default")
    label = f"args.{name}" + (f" of part '{scope}'" if scope else "")
    node = found_at(manifest, path)
    if node is not None:
        below = tuple(map(_layer, manifest.history.of(path)[:-1]))
        yield ArgumentSource(label, shown(node), origin_of(manifest, path, node), below)
        yield from _sources(manifest, path)
    elif scope in manifest.parts:
        given = "given by the part that includes it, else " if "." in scope else ""
        yield ArgumentSource(label, f"{given}the default in {manifest.parts[scope].file}", None)


def _unwritten(robot: Robot, guide: Guide, path: KeyPath) -> PathAnswer | None:
    """Return the answer for a key that exists but is not written."""
    if given := _input(robot, path):
        return _unwritten_input(path, given)
    if not all(is_known(robot.manifest, guide, path[:length]) for length in range(1, len(path) + 1)):
        return None
    if guide.keys(path):
        body = expand_below(robot.manifest, path, MappingNode(), dict(_defaults(guide, path, MappingNode())))
        return PathAnswer(
            short(path), "the defaults, no file writes it", guide.describe(path), is_default=True, body=body
        )
    value, default = guide.value(path), _default(guide.value(path).default)
    component = robot.components.get(str(path[1])) if len(path) == 3 and path[0] == "components" else None
    of = f" of type '{component.type_name}'" if component else ""
    said = f"no file writes it: this is the default{of}" if default else "no file writes it, and it has no default"
    where = key_span(tree_of(robot.manifest, path), path[:-1]) if found_at(robot.manifest, path[:-1]) else None
    below = f"'{path[-1]}:' below {where}, or " if where is not None and len(path) > 1 else ""
    dimension = value.dimension
    si = _si(ScalarNode(default, robot.manifest.root.span), dimension) if default else None
    hints = (("where", said), ("to set it", below + _to_set(path)))
    return PathAnswer(
        short(path), default or "nothing", guide.describe(path), dimension, si, is_default=True, hints=hints
    )


def _unwritten_input(path: KeyPath, given: Input) -> PathAnswer:
    default = given.default
    value = "nothing" if default is None else show_value(given.type, default.value)
    said = f"no file writes it: this is the default of the mission ({given.span})" if default else f"see {given.span}"
    hints = (("where", said), ("to set it", _to_set(path)))
    dimension, si = given.type.dimension, default.value if default else None
    is_measured = dimension is not None and isinstance(si, float)
    return PathAnswer(
        short(path),
        value,
        "An input of the mission.",
        dimension if is_measured else None,
        si if isinstance(si, float) else None,
        is_default=True,
        hints=hints,
    )


def _to_set(path: KeyPath) -> str:
    return f"{SET} {short(path)}=VALUE"


def _input(robot: Robot, path: KeyPath) -> Input | None:
    """Return the mission input that a path names."""
    match path:
        case ("missions", str(mission), "with", str(name)) if mission in robot.missions:
            return robot.missions[mission].program.inputs.get(name)
    return None


def _default(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return "" if value is None or isinstance(value, dict) else plain(str(value))


def _defaults(guide: Guide, path: KeyPath, node: MappingNode) -> Iterator[tuple[str, str]]:
    """Yield the keys of a map that are not written but have a default, with that default."""
    for key in guide.keys(path):
        if key not in node and (default := _default(guide.value((*path, key)).default)):
            yield key, default
