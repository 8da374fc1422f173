"""What cannot work, or works badly, because it is on several hosts or shared between robots."""

from collections.abc import Collection, Iterable, Iterator

from rbxcompose.base.findings import Finding, Related, Severity, Span, kind
from rbxcompose.base.units import BIT_RATE, FREQUENCY, TIME, format_quantity
from rbxcompose.compiler.model.robot import resolve
from rbxcompose.compiler.systems import share
from rbxcompose.compiler.systems.certificates import MUTUAL, NO_SECURITY
from rbxcompose.compiler.systems.cut_link import slow_stops
from rbxcompose.compiler.systems.model import Crossing, PlacedRobot, System, TopicEnd
from rbxcompose.compiler.systems.neighbours import overlapping_starts
from rbxcompose.compiler.systems.share import hosts_of, listens
from rbxcompose.manifest.tree import key_span, value_span
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import type_hash
from rbxcompose.sdk.capabilities import ConnectedBy, Drives
from rbxcompose.sdk.ports import In, Out, Qos

UNKNOWN_HOST = kind("RBX6100", is_fixable=True)
NOT_PUBLISHED = kind("RBX6123", is_fixable=True)
NOT_SHARED = kind("RBX6124", Severity.WARNING)
TAKEN_NAME = kind("RBX6125")
OTHER_TYPE = kind("RBX6126")
UNREACHED_SHARE = kind("RBX6127")
NO_CALLER = kind("RBX6150")
UNKNOWN_CALLER = kind("RBX6151", is_fixable=True)
NOT_A_CALLER = kind("RBX6152")
_WORDS = {"msg": "topic", "srv": "service", "action": "action"}


def share_findings(system: System) -> Iterator[Finding]:
    """Yield what is wrong with what robots share, and with what they take from each other."""
    takers = share.takers_of(system)
    labels = {label for robot in system.robots.values() for label in robot.labels}
    for robot in system.robots.values():
        for index, name in enumerate(robot.model.callers):
            if name not in labels:
                span, message = robot.span(system.root, "callers", index), f"the system has no robot '{name}'"
                yield UNKNOWN_CALLER.misspelt(span, message, name, sorted(labels), "robots and labels")
        for index, name in enumerate(robot.model.share):
            span = robot.span(system.root, "share", index)
            givers = share.givers_of(robot, share.full_name(robot, name))
            if givers:
                own = [pair for pair in takers.get(share.shared_name(robot.name, name), ()) if pair[0] is not robot]
                yield from _wrong_takers(system, robot, name, own, span)
            else:
                valid = sorted({end.topic.removeprefix("/") for end in robot.ends if _gives(end)})
                message = f"no component of '{robot.name}' publishes or serves '{name}'"
                yield NOT_PUBLISHED.misspelt(span, message, name.removeprefix("/"), valid, "what it has")
            if givers and share.is_called(givers[0]) and not robot.model.callers:
                message = f"'{name}' is {_kind(givers[0])}, which no other robot may call"
                yield NO_CALLER.at(span, message, help="add 'callers' with the robots that may")
        yield from _unshared(system, robot)


def _gives(topic_end: TopicEnd) -> bool:
    return isinstance(topic_end.end.port, tuple(share.TAKEN_BY))


def _kind(end: TopicEnd) -> str:
    word = _WORDS[end.type.split("/")[1]]
    return f"{'an' if word == 'action' else 'a'} {word}"


def _wrong_takers(
    system: System, robot: PlacedRobot, name: str, takers: Iterable[tuple[PlacedRobot, TopicEnd]], span: Span
) -> Iterator[Finding]:
    shared, first = (share.shared_name(robot.name, name), share.givers_of(robot, share.full_name(robot, name))[0])
    for taker, end in takers:
        where, given = f"'{end.end.component}' of '{taker.name}'", first.end.host
        if end.type != first.type:
            yield OTHER_TYPE.at(span, f"{where} takes {shared} for {_typed(end)}, and it is {_typed(first)}")
        elif len({_definition(taker, end.type), _definition(robot, end.type), ""}) > 2:
            yield OTHER_TYPE.at(span, f"{where} has another definition of {end.type} than '{robot.name}'")
        elif share.is_called(first) and robot.model.callers and not share.may_call(robot, taker):
            message = f"{where} calls {shared}, and '{taker.name}' is not among the callers of '{robot.name}'"
            names = ", ".join([*robot.model.callers, taker.name])
            at = robot.span(system.root, "callers")
            yield NOT_A_CALLER.at(at, message, help=f"if it may: callers: [{names}]")
        if not share.endpoint_for(system, robot, given, is_local=given == end.end.host):
            message = f"{where} runs on '{end.end.host}' and needs {shared} from '{given}', which has no address"
            yield UNREACHED_SHARE.at(span, message, help=f"give '{given}' an 'address'")
        for placed_robot in (robot, taker):
            if placed_robot.plan.bus.router is not None:
                message = f"'{placed_robot.name}' has 'bus.router', so {shared} cannot get to {where}"
                yield UNREACHED_SHARE.at(span, message, help="remove 'bus.router'")
    for other in system.robots.values():
        for end in share.givers_of(other, shared) if other is not robot else ():
            does = "publishes" if isinstance(end.end.port, Out) else "serves"
            message = f"'{end.end.component}' of '{other.name}' {does} {shared}, which '{robot.name}' shares"
            yield TAKEN_NAME.at(span, message, help="give it another name there")


def _definition(robot: PlacedRobot, name: str) -> str:
    """Return the hash of a type of a robot's own, empty for another one."""
    own = robot.plan.messages
    return type_hash(name, registry.types_of(own).structures) if name in own else ""


def _typed(topic_end: TopicEnd) -> str:
    is_plain = isinstance(topic_end.end.port, In | Out)
    return f"a {topic_end.type}" if is_plain else f"{_kind(topic_end)} {topic_end.type}"


def _unshared(system: System, robot: PlacedRobot) -> Iterator[Finding]:
    """Yield a finding for each end that takes something of another robot that this one does not share."""
    for end in robot.ends:
        name, _, own = end.topic.removeprefix("/").partition("/")
        other = system.robots.get(name)
        if _gives(end) or other is None or other is robot or share.givers_of(robot, end.topic):
            continue
        if end.topic not in {share.shared_name(name, each) for each in other.model.share}:
            does = "listens to" if isinstance(end.end.port, In) else "calls"
            message = f"'{end.end.component}' of '{robot.name}' {does} {end.topic}, which '{name}' does not share"
            yield NOT_SHARED.at(other.span(system.root), message, help=_cure(other, own))


def _cure(robot: PlacedRobot, name: str) -> str:
    given: Collection[str] = {end.topic.removeprefix("/") for end in robot.ends if _gives(end)}
    if name in given:
        return f"share: [{', '.join([*robot.model.share, name])}]"
    return f"'{robot.name}' has {', '.join(sorted(given))}"


FASTEST = 100.0  # [Hz] of commands across a link; wireless links pause for tens of milliseconds
SHORTEST = 0.2  # [s] without a command, within which a base should not brake because of a link

DEVICE_ELSEWHERE = kind("RBX6103")
NO_ADDRESS = kind("RBX6104")
FAST_LOOP = kind("RBX6105", Severity.WARNING)
BULK = kind("RBX6106", Severity.WARNING)
SAME_ENDPOINT = kind("RBX6107")
NOT_OURS = kind("RBX6108")


IDLE_LINK = kind("RBX6118", Severity.WARNING, is_fixable=True)
FEWER_COMMANDS = kind("RBX6119")
PLAIN_QUIC = kind("RBX6141")
TOO_MUCH = kind("RBX6120", Severity.WARNING)

OPTIONAL_BASE = kind("RBX6145", Severity.WARNING)
SAME_ADDRESS = kind("RBX6146")


def system_findings(system: System) -> Iterator[Finding]:
    """Yield what is wrong with a system whose robots are placed."""
    yield from _same_addresses(system)
    for robot in system.robots.values():
        yield from _devices(system, robot)
        yield from _bases(system, robot)
        yield from _addresses(system, robot)
        if len(hosts_of(system, robot)) > 1:
            yield from _router(system, robot)
        yield from slow_stops(system, robot)
        for crossing in robot.crossings:
            yield from _commands(system, robot, crossing)
            yield from _bulk(system, robot, crossing)
    yield from _ports(system)
    yield from overlapping_starts(system)
    yield from share_findings(system)
    for name in system.links:
        yield from _link(system, name)


def _place(system: System, robot: PlacedRobot, component: str) -> Span:
    """Return where the system's file places a component."""
    for keys in (("place", component), ("on",)):
        if keys[-1] in robot.model.place or (keys == ("on",) and robot.model.on):
            return value_span(system.root, ("robots", robot.entry, *keys))
    return value_span(system.root, ("robots", robot.entry, "robot"))


def _devices(system: System, robot: PlacedRobot) -> Iterator[Finding]:
    for component, connected in robot.robot.declared(ConnectedBy):
        host = robot.hosts[component.name]
        having = [name for name, model in system.hosts.items() if connected.is_among(model.devices)]
        if having and host not in having:
            message = f"'{component.name}' runs on '{host}', but {connected.name} is connected to '{having[0]}'"
            span = value_span(system.root, ("hosts", having[0], "devices"))
            yield DEVICE_ELSEWHERE.at(
                _place(system, robot, component.name),
                message,
                help=f"place: {{{component.name}: {having[0]}}}",
                related=[Related(span, "the device")],
            )


def _bases(system: System, robot: PlacedRobot) -> Iterator[Finding]:
    for base, _ in robot.robot.declared(Drives):
        host = robot.hosts[base.name]
        if system.hosts[host].optional and len(hosts_of(system, robot)) > 1:
            span = key_span(system.root, ("hosts", host, "optional"))
            message = f"'{robot.name}' starts without '{host}', where its base '{base.name}' runs"
            related = [Related(_place(system, robot, base.name), "it runs there")]
            yield OPTIONAL_BASE.at(span, message, help="remove 'optional', or run it on another host", related=related)


def _same_addresses(system: System) -> Iterator[Finding]:
    seen: dict[str, str] = {}
    for name, host in system.hosts.items():
        if host.address is not None and (other := seen.setdefault(host.address, name)) != name:
            span, first = (value_span(system.root, ("hosts", text, "address")) for text in (name, other))
            message = f"'{other}' and '{name}' have the same address"
            yield SAME_ADDRESS.at(span, message, related=[Related(first, "the other host")])


def _addresses(system: System, robot: PlacedRobot) -> Iterator[Finding]:
    without = [name for name in hosts_of(system, robot) if system.hosts[name].address is None]
    for name in without[1:]:
        message = f"'{without[0]}' and '{name}' both run '{robot.name}', and neither has an address"
        span = value_span(system.root, ("hosts", name))
        related = [Related(value_span(system.root, ("hosts", without[0])), "the other host")]
        yield NO_ADDRESS.at(span, message, help="give one of them an 'address'", related=related)


def _router(system: System, robot: PlacedRobot) -> Iterator[Finding]:
    bus, span = robot.plan.bus, value_span(system.root, ("robots", robot.entry, "robot"))
    if bus.router is not None:
        yield NOT_OURS.at(
            span, f"'{robot.name}' runs on several hosts and has 'bus.router'", help="remove 'bus.router'"
        )
    if bus.access == "user" and system.security != MUTUAL:
        message = f"'{robot.name}' runs on several hosts and has 'bus.access: user'"
        yield NOT_OURS.at(span, message, help="add 'security: mtls', or remove 'bus.access'")


def _commands(system: System, robot: PlacedRobot, crossing: Crossing) -> Iterator[Finding]:
    if crossing.qos is not Qos.COMMAND:
        return
    for end in crossing.takers:
        span, where = _place(system, robot, end.component), f"{crossing.topic} crosses to '{end.component}'"
        drives = robot.robot.components[end.component].declared(Drives)
        stops = min((drive.stops_after.value for drive in drives if drive.stops_after), default=None)
        if crossing.rate is not None and crossing.rate >= FASTEST:
            rate = format_quantity(crossing.rate, FREQUENCY)
            yield FAST_LOOP.at(span, f"{where} {rate}", help="run both on one host")
        elif stops is not None and stops < SHORTEST:
            message = f"{where}, which brakes after {format_quantity(stops, TIME)} without a command"
            yield FAST_LOOP.at(span, message, help="run both on one host, or make the deadline longer")


def _bulk(system: System, robot: PlacedRobot, crossing: Crossing) -> Iterator[Finding]:
    if crossing.qos is Qos.BULK:
        giver, taker = crossing.givers[0], crossing.takers[0]
        message = f"{crossing.topic} crosses in full from '{giver.component}' to '{taker.component}'"
        yield BULK.at(_place(system, robot, taker.component), message, help="run both on one host")


def _ports(system: System) -> Iterator[Finding]:
    seen: dict[tuple[str, str], PlacedRobot] = {}
    shared = share.exchanges(system)
    for robot in system.robots.values():
        for host in hosts_of(system, robot):
            carried = shared.get((robot.name, host))
            for endpoint in (*listens(system, robot, host), *(carried.listen if carried else ())):
                here = host if endpoint.startswith("tcp/127.") else ""  # each host has a loopback interface
                if (other := seen.setdefault((here, endpoint), robot)) is not robot:
                    is_link = carried is None or endpoint not in carried.listen
                    span = value_span(system.root, ("robots", robot.entry, "link_port" if is_link else "share_port"))
                    message = f"the routers of '{other.name}' and '{robot.name}' on '{host}' both listen at {endpoint}"
                    yield SAME_ENDPOINT.at(span, message, help="give one of them another 'link_port', or none")


def _link(system: System, name: str) -> Iterator[Finding]:
    link, known = system.links[name], True
    for index, host in enumerate(link.between):
        if host not in system.hosts:
            known, span = False, value_span(system.root, ("links", name, "between", index))
            yield UNKNOWN_HOST.misspelt(span, f"the system has no host '{host}'", host, system.hosts, "hosts")
    if not known:
        return
    crossing = {
        (robot.name, one.topic): one
        for robot in system.robots.values()
        for one in robot.crossings
        if one.passes(link.between)
    }
    if link.protocol == "quic" and system.security == NO_SECURITY:
        span = value_span(system.root, ("links", name, "protocol"))
        yield PLAIN_QUIC.at(span, f"'{name}' is to use QUIC without certificates", help="add 'security: mtls'")
    for key, topic in [("downsample", one) for one in link.downsample] + [("priorities", o) for o in link.priorities]:
        span = key_span(system.root, ("links", name, key, topic))
        found = [one for (robot, full), one in crossing.items() if full == _full(system, robot, topic)]
        if not any(one.qos for one in found):
            valid = sorted(full.removeprefix("/") for (_, full), one in crossing.items() if one.qos)
            message = f"no topic '{topic}' crosses between '{link.between[0]}' and '{link.between[1]}'"
            yield IDLE_LINK.misspelt(span, message, topic, valid, "topics that do")
        elif any(one.qos is Qos.COMMAND for one in found):
            yield FEWER_COMMANDS.at(span, f"{found[0].topic} has commands", help="remove it here")
    if link.limit is not None:
        rates = {full: link.downsample.get(full.removeprefix("/")) for _, full in crossing}
        needed = sum(one.bandwidth_at(rates[full]) or 0.0 for (_, full), one in crossing.items())
        if needed > link.limit:
            message = f"what is known to cross '{name}' needs about {format_quantity(needed, BIT_RATE)}"
            yield TOO_MUCH.at(
                value_span(system.root, ("links", name, "limit")), message, help="'downsample' some topics"
            )


def _full(system: System, robot: str, topic: str) -> str:
    return resolve(topic, system.robots[robot].plan.bus.namespace)
