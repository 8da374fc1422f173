"""What cannot work, or works badly, because it is on several hosts."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding, Related, Severity, Span, kind
from rbxcompose.manifest.tree import key_span, value_span
from rbxcompose.model.wires import resolve
from rbxcompose.qos import Qos
from rbxcompose.sdk.capabilities import ConnectedBy, Drives
from rbxcompose.systems.certificates import MUTUAL, NO_SECURITY
from rbxcompose.systems.codes import UNKNOWN_HOST
from rbxcompose.systems.cut_link import slow_stops
from rbxcompose.systems.exchange import exchanges
from rbxcompose.systems.model import PlacedRobot, System
from rbxcompose.systems.share import hosts_of, listens
from rbxcompose.systems.share_rules import share_findings
from rbxcompose.systems.traffic import Crossing
from rbxcompose.units import BIT_RATE, FREQUENCY, TIME, format_quantity

FASTEST = 100.0  # [Hz] of commands across a link; wireless links pause for tens of milliseconds
SHORTEST = 0.2  # [s] without a command, within which a base should not brake because of a link

DEVICE_ELSEWHERE = kind(
    "RBX6103",
    """A component runs on another host than its device

A component that opens a serial port has to run on the host that the device is connected to. `devices` of a host lists
what is connected there.

Bad:
```yaml
hosts:
  robot: {address: 10.42.0.2, devices: [/dev/ttyUSB0]}
  desk: {}
robots:
  arm:
    robot: ../robots/arm/robot.yaml
    on: desk
    place: {servos: desk}
```
Good:
```yaml
    place: {servos: robot}
```
""",
)
NO_ADDRESS = kind(
    "RBX6104",
    """Two hosts cannot find each other

The hosts of a robot are linked router to router. Of two hosts, one dials the other, which needs an `address`.

Bad:
```yaml
hosts:
  robot: {}
  desk: {}
```
Good:
```yaml
hosts:
  robot: {address: 10.42.0.2}
  desk: {}
```
""",
)
FAST_LOOP = kind(
    "RBX6105",
    """Fast commands cross between hosts

A link between hosts pauses at times: Wi-Fi for tens of milliseconds, sometimes more. Commands that must come often and
in time belong on the host of what they move. A base whose `command_timeout` is short brakes at each pause.

Bad: a base with `command_timeout: 0.1 s` on the robot, and what drives it on a desk.
Good: both on the robot, or `command_timeout: 0.5 s`.
""",
    Severity.WARNING,
)
BULK = kind(
    "RBX6106",
    """Large messages cross between hosts

Topics of the class `bulk`, such as images, go through shared memory within a host. Between hosts each message is sent
in full over the link.

Bad: a camera on the robot, and what finds faces in its images on a desk with Wi-Fi.
Good: both on the robot; what was found crosses.
""",
    Severity.WARNING,
)
SAME_ENDPOINT = kind(
    "RBX6107",
    """Two routers listen at one port

Each robot has a router of its own on each host. Two of them cannot listen at one port.

Bad: two robots of a system whose bases are on one host, both with `link_port: 7447`.
Good: leave `link_port` out; each robot gets a port of its own.
""",
)
NOT_OURS = kind(
    "RBX6108",
    """A robot on several hosts uses a router of others, or keeps strangers out by sockets

On several hosts, a robot needs routers of its own, which are linked. With `bus.router`, it uses one that exists. With
`bus.access: user`, other users of the host are kept out, but without `security: mtls` the link would let every machine
of the network in.

Bad: a robot with `bus: {router: tcp/192.168.0.2:7447}` whose components are placed on two hosts.
Good: the same robot without `bus.router`.
""",
)


IDLE_LINK = kind(
    "RBX6118",
    """The topic does not cross this link

`downsample` and `priorities` of a link are for topics with a publisher on one of its hosts and a subscriber on the
other. This one stays within a host, goes another way, or does not exist.

Bad:
```yaml
links:
  wifi: {between: [robot, desk], downsample: {batery_level: 2 Hz}}
```
Good:
```yaml
links:
  wifi: {between: [robot, desk], downsample: {battery_level: 2 Hz}}
```
""",
    Severity.WARNING,
    is_fixable=True,
)
FEWER_COMMANDS = kind(
    "RBX6119",
    """Commands would be left out, or wait

A base brakes when no command has come for a while, and what steers it relies on each. Messages of the class `command`
are not downsampled, and go before all others.

Bad:
```yaml
links:
  wifi: {between: [robot, desk], downsample: {cmd_vel: 1 Hz}}
```
Good: run what commands on the host of what moves.
""",
)
PLAIN_QUIC = kind(
    "RBX6141",
    """QUIC needs certificates

QUIC is always encrypted, so its routers need the certificates that `security init` makes.

Bad: `wifi: {between: [robot, desk], protocol: quic}` in a system without `security`.
Good: the same with `security: mtls`.
""",
)
TOO_MUCH = kind(
    "RBX6120",
    """More crosses than the link carries

The topics whose rates are known need more than `limit`, by the least size of their messages.

Bad: a lidar with 40 Hz across `wifi: {between: [robot, desk], limit: 100 kbit/s}`.
Good: `downsample: {scan: 2 Hz}` on this link.
""",
    Severity.WARNING,
)

OPTIONAL_BASE = kind(
    "RBX6145",
    """What drives the robot runs on a host that it can do without

The other hosts do not wait for a host that is `optional`: the robot starts, and its missions run, without its base.

Bad:
```yaml
hosts:
  robot: {address: 10.42.0.2, optional: true}
robots:
  turtlebot:
    place: {base: robot}
```
Good:
```yaml
hosts:
  robot: {address: 10.42.0.2}
```
""",
    Severity.WARNING,
)
SAME_ADDRESS = kind(
    "RBX6146",
    """Two hosts have one address

An address leads to one machine, so one of the hosts is never reached.

Bad:
```yaml
hosts:
  robot: {address: 10.42.0.2}
  desk: {address: 10.42.0.2}
```
Good:
```yaml
hosts:
  robot: {address: 10.42.0.2}
  desk: {address: 10.42.0.1}
```
""",
)


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
        port = connected.port.value
        having = [name for name, one in system.hosts.items() if port in one.devices]
        if having and host not in having:
            message = f"'{component.name}' runs on '{host}', but {port} is connected to '{having[0]}'"
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
            span, first = (value_span(system.root, ("hosts", one, "address")) for one in (name, other))
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
        stops = min((one.stops_after.value for one in drives if one.stops_after), default=None)
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
    shared = exchanges(system)
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
