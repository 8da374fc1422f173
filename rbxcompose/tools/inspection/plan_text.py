"""Plans for people: of a robot, of the changes to a running one, of a system."""

from collections.abc import Iterator, Mapping
from typing import Any

from rbxcompose.base.config import Restart
from rbxcompose.base.findings import Span
from rbxcompose.base.levels import Level, log_word
from rbxcompose.base.printable import plain
from rbxcompose.base.requests import to_data
from rbxcompose.base.units import BIT_RATE, FREQUENCY, TIME, format_quantity
from rbxcompose.bus.names import EXCHANGE_DOMAIN
from rbxcompose.compiler.composition.overlay import SET
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.plan.diff import Change
from rbxcompose.compiler.plan.model import BusPlan, Instance, Plan, Wire, extent
from rbxcompose.compiler.systems.cut_link import every_stop, stops_after_cut, stops_of_goals
from rbxcompose.compiler.systems.model import Crossing, PlacedRobot, System
from rbxcompose.compiler.systems.share import exchange_of, hosts_of, robots_on, share_of, shared_crossings
from rbxcompose.manifest.tree import KeyPath, TreeNode, at, key_span, value_span
from rbxcompose.sdk.ports import Looks, Port
from rbxcompose.tools.inspection.diagram import does, keys_of, qos_of
from rbxcompose.tools.inspection.origin import indexed

_NUMBER = 4  # width of a position in the start order
LONGEST = 6  # reasons shown for one component
_TOPIC = "topic of "  # prefix of the key of a wire
_TEXT = 200  # characters of a reason
_OPEN_TO = {
    "none": "open to every machine of the network",
    "tls": "encrypted, open to every machine of the network",
    "mtls": "for hosts of the system",
}


def plan_text(plan: Plan, *, with_keys: bool = False) -> str:
    """Return what `up` would do: processes with their components in start order, and the keys on the wire if wanted."""
    return "\n".join(_lines(plan, with_keys))


def _lines(plan: Plan, with_keys: bool) -> Iterator[str]:
    how = "simulated" if plan.is_simulated else "real devices"
    yield f"{plan.robot}: {extent(len(plan.instances), len(plan.groups))}, {how}"
    yield from (f"  {label:<8}{text}" for label, text in _facts(plan))
    order = {instance.name: number for number, instance in enumerate(plan.instances, 1)}
    for group in plan.groups:
        yield ""
        yield f"process {group}"
        for instance in plan.of_group(group):
            yield f"{order[instance.name]:>{_NUMBER}} {instance.name} ({', '.join(_options(instance))})"
            yield from (f"{'':<{_NUMBER}}   {line}" for line in _wires(plan, instance, with_keys))


def _facts(plan: Plan) -> Iterator[tuple[str, str]]:
    bus = plan.bus
    own = "by sockets of this user only" if bus.access == "user" else f"at port {bus.port}, or the next free one"
    router = bus.router or f"its own {own}"
    through = ", through which all messages go" if bus.links == "router" else ""
    namespace = f"namespace {bus.namespace}" if bus.namespace else "no namespace"
    yield "bus", f"domain {bus.domain}, {namespace}, wire format {bus.wire}"
    yield "router", f"{router}{through}"
    if plan.follows_clock:
        yield "time", "follows /clock, which is published from outside"
    yield "mission", f"{plan.start}, as soon as everything is active" if plan.start else "none starts by itself"


def _options(instance: Instance) -> Iterator[str]:
    yield instance.type
    if instance.starts_after:
        yield f"after {', '.join(instance.starts_after)}"
    if instance.log is not Level.OK:
        yield f"logs {log_word(instance.log)} and above"
    if instance.restart != Restart():
        yield f"restarts: {instance.restart.when}, at most {instance.restart.max} within {instance.restart.within:g} s"


def _wires(plan: Plan, instance: Instance, with_keys: bool) -> Iterator[str]:
    ports = plan.ports(instance)
    for wire in instance.wires:
        port = ports.get(wire.port)
        if port is not None:
            yield _wire(wire, port)
            keys = keys_of(port, wire.topic, plan.bus) if with_keys else []
            yield from (f"    {f'{what}: ' if len(keys) > 1 else ''}{key}" for what, key in keys)


def _wire(wire: Wire, port: Port[Any]) -> str:
    if isinstance(port, Looks):
        return f"{does(port)} '{port.source}' in '{port.target}'"
    qos = f" as {qos_of(port)}" if qos_of(port) else ""
    return f"{does(port)} {wire.topic} ({wire.type}){qos}"


def with_places(found: Mapping[str, Any], robot: Robot) -> dict[str, Any]:
    """Return the difference, with the place of each new value that is written in the robot's files."""
    components = []
    for component in found["components"]:
        reasons = [{**each, "place": _place(robot, component["name"], each)} for each in component["reasons"]]
        components.append({**component, "reasons": reasons})
    return {**found, "components": components}


def changes_text(found: Mapping[str, Any]) -> str:
    """Return the result of `with_places` for people: component by component, with the reasons."""
    return "\n".join(_change_lines(found))


def _change_lines(found: Mapping[str, Any]) -> Iterator[str]:
    components = found["components"]
    fates = dict.fromkeys(entry["fate"] for entry in components)
    counts = (f"{sum(entry['fate'] == fate for entry in components)} {fate}" for fate in fates)
    yield f"{found['robot']}: {', '.join(counts)}"
    widths = [max(len(one[column]) for one in components) for column in ("fate", "name")]
    for component in components:
        yield f"  {component['fate']:<{widths[0]}}  {component['name']:<{widths[1]}}  process {component['process']}"
        shown = component["reasons"][:LONGEST]
        yield from (f"      {_reason(each)}" for each in shown)
        if len(shown) < len(component["reasons"]):
            yield f"      and {len(component['reasons']) - len(shown)} more"
    yield from (plain(text, _TEXT) for text in found["said"])


def _reason(each: Mapping[str, str]) -> str:
    text = plain(str(Change(each["key"], each["before"], each["after"])), _TEXT)
    place = each["place"]
    return f"{text} {'by' if place == SET else 'at'} {place}" if place else text


def _place(robot: Robot, component: str, reason: Mapping[str, str | None]) -> str:
    """Return the place of the new value, empty if it is not written."""
    key = str(reason["key"])
    if component not in robot.components or reason["after"] is None:
        return ""
    root, path, least = _source(robot, component, key)
    path = indexed(root, path)
    if at(root, path[:least]) is None:
        return ""
    span: Span = value_span(root, path) if at(root, path) is not None else key_span(root, path)
    return SET if span.file == SET else str(span)


def _source(robot: Robot, component: str, key: str) -> tuple[TreeNode, KeyPath, int]:
    """Return the tree that contains a key of a component, its path there, and how much of that path must exist."""
    root, own = robot.manifest.root, robot.components[component].path
    if key.startswith(_TOPIC):
        return root, (*own, "connect", key.removeprefix(_TOPIC)), len(own) + 2
    keys = tuple(key.split("."))
    match keys:
        case _ if at(root, own) is not None:
            return root, (*own, *keys), len(own) + 1
        case ("programs", name, *rest) if name in robot.missions:
            return robot.missions[name].program.root, tuple(rest), 0
        case ("inputs", name, *rest):
            return root, ("missions", name, "with", *rest), 3
    return root, keys, 1


def system_extent(system: System) -> str:
    """Return the size of a system in words: `1 robot on 2 hosts`."""
    robots, hosts = len(system.robots), len(system.hosts)
    return f"{robots} robot{'s' if robots != 1 else ''} on {hosts} host{'s' if hosts != 1 else ''}"


def system_text(system: System, *, with_keys: bool = False) -> str:
    """Return what `up` would run on each host, why, and what would cross between hosts."""
    return "\n".join(_system_lines(system, with_keys))


def _system_lines(system: System, with_keys: bool) -> Iterator[str]:
    yield f"{system.name}: {system_extent(system)}"
    for host, facts in system.hosts.items():
        optional = ", the others start without it" if facts.optional else ""
        yield ""
        yield f"host {host}{f' at {facts.address}' if facts.address else ''}{optional}"
        for robot in robots_on(system, host):
            yield from (f"  {line}" for line in _share(system, robot, host))
        if not robots_on(system, host):
            yield "  nothing runs here"
    for robot in system.robots.values():
        if robot.crossings:
            yield ""
            yield f"between the hosts of {robot.name}"
            yield from (
                f"  {line}" for crossing in robot.crossings for line in _crossing(crossing, robot.plan.bus, with_keys)
            )
        for _, stop in every_stop(robot):
            yield ""
            allowed = format_quantity(robot.model.stop_within, TIME)
            yield f"after a link of {robot.name} is cut, {stop.text}; it may take {allowed}"
    if shared := [*shared_crossings(system)]:
        yield ""
        yield "between robots"
        yield from (
            f"  {line}" for crossing in shared for line in _crossing(crossing, BusPlan(EXCHANGE_DOMAIN), with_keys)
        )


def _share(system: System, robot: PlacedRobot, host: str) -> Iterator[str]:
    plan = share_of(system, robot, host)
    yield f"{robot.name}: {extent(len(plan.instances), len(plan.groups))}"
    if plan.share is not None:
        yield from (f"  its router listens at {text}, {_OPEN_TO[system.security]}" for text in plan.share.listen)
        yield from (f"  its router dials {one}" for one in plan.share.connect)
        for topic, rate in plan.share.downsample.items():
            yield f"  at most {format_quantity(rate, FREQUENCY)} of {topic} leave it"
        yield from (f"  {topic} leaves it with {word} priority" for topic, word in plan.share.priorities.items())
        yield from (f"  {topic} leaves it up to {size:,} bytes" for topic, size in plan.share.largest.items())
    if (exchange := exchange_of(system, robot, host)) is not None:
        yield from (f"  gives {wire.own} to other robots as {wire.shared}" for wire in exchange.gives)
        yield from (f"  takes {wire.shared} from another robot" for wire in exchange.takes)
        yield from (f"  other robots fetch at {text}, {_open(system, text)}" for text in exchange.listen)
        yield from (f"  fetches at {text}" for text in exchange.connect)
    for group in plan.groups:
        yield f"  process {group}"
        yield from (f"    {one.name} ({one.type}): {robot.placed[one.name].reason}" for one in plan.of_group(group))


def _open(system: System, endpoint: str) -> str:
    return "open to programs of this machine" if endpoint.startswith("tcp/127.") else _OPEN_TO[system.security]


def _crossing(crossing: Crossing, bus: BusPlan, with_keys: bool) -> Iterator[str]:
    way = f"{_ends(crossing.givers)} -> {_ends(crossing.takers)}"
    yield f"{crossing.topic} ({crossing.type}{f', {crossing.qos}' if crossing.qos else ''}): {way}{_load(crossing)}"
    if with_keys:
        yield from (f"  {key}" for _, key in keys_of(crossing.givers[0].port, crossing.topic, bus))


def _ends(ends: tuple[Any, ...]) -> str:
    return ", ".join(f"{end.component} on {end.host}" for end in ends)


def _load(crossing: Crossing) -> str:
    if crossing.rate is None or crossing.bandwidth is None:
        return ""
    return f", about {format_quantity(crossing.rate, FREQUENCY)}, {format_quantity(crossing.bandwidth, BIT_RATE)}"


def system_data(system: System) -> dict[str, Any]:
    """Return the same as data for programs."""
    return {
        "system": system.name,
        "hosts": {name: _host(system, name) for name in system.hosts},
        "robots": {
            name: {
                "placed": {key: {"host": at.host, "reason": at.reason} for key, at in robot.placed.items()},
                "hosts": hosts_of(system, robot),
                "crossing": [_data(each) for each in robot.crossings],
                "stops_after_cut": {each.base: each.time for each in stops_after_cut(robot)},
                "stops_of_goals": {each.server: each.time for each in stops_of_goals(robot)},
            }
            for name, robot in system.robots.items()
        },
        "shared": [_data(crossing) for crossing in shared_crossings(system)],
    }


def _host(system: System, name: str) -> dict[str, Any]:
    shares = {robot.name: share_of(system, robot, name) for robot in robots_on(system, name)}
    return {
        "address": system.hosts[name].address,
        "robots": {
            robot: {
                "processes": {group: [one.name for one in plan.of_group(group)] for group in plan.groups},
                "listen": list(plan.share.listen) if plan.share else [],
                "connect": list(plan.share.connect) if plan.share else [],
                "exchange": to_data(exchange_of(system, system.robots[robot], name)),
            }
            for robot, plan in shares.items()
        },
    }


def _data(crossing: Crossing) -> dict[str, Any]:
    return {
        "topic": crossing.topic,
        "type": crossing.type,
        "from": [{"component": end.component, "host": end.host} for end in crossing.givers],
        "to": [{"component": end.component, "host": end.host} for end in crossing.takers],
        "rate": crossing.rate,
        "bandwidth": crossing.bandwidth,
    }
