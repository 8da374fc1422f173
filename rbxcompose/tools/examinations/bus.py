"""What is on the bus of each robot: clocks that disagree, clashing types, ports of routers, wires with one end."""

from collections.abc import Iterator

from rbxcompose.base.findings import Finding, Severity, kind
from rbxcompose.base.printable import plain
from rbxcompose.bus.endpoints import is_private
from rbxcompose.bus.graph import GraphName
from rbxcompose.compiler.sections.bus import BusModel
from rbxcompose.sdk.ports import In
from rbxcompose.tools.doctor import HostFacts, Listener, RunningRobot, examination

PORT_TAKEN = kind("RBX9402", Severity.WARNING)
NO_LISTENER = kind("RBX9403")
CLASH = kind("RBX9408")
MOST_STEP = 0.05  # [s] by which the wall clock may move against the monotonic one while we look
MOST_AHEAD, MOST_BEHIND = 0.05, 1.0  # [s] of a sender's stamps; those behind also include the transport time
WRONG_CLOCK = kind("RBX9404", Severity.WARNING)
OTHER_CLOCK = kind("RBX9405", Severity.WARNING)
HOSTS_DIFFER = kind("RBX6129", Severity.WARNING)
_HELP = "let a time server set it: timedatectl set-ntp true"
NOBODY_PUBLISHES = kind("RBX9407", Severity.WARNING)
_MOST_NAMES = 8  # names


@examination
def ports(facts: HostFacts) -> Iterator[str | Finding]:
    """Check the routers of robots that are up and what else of them is open, and the port that the named one needs."""
    for robot in facts.running:
        yield from _router(robot, facts)
        yield from _open_to_network(robot, facts)
    names = {running_robot.name for running_robot in facts.running}
    if facts.file is None:
        wanted = [] if facts.running else [BusModel().port]
    else:
        bus = facts.file.manifest.bus
        needs_none = facts.file.manifest.name in names or bus.router or bus.access == "user"
        wanted = [] if needs_none else [bus.port]
    for port in wanted:
        taken = facts.listeners.get(port)
        if taken is None:
            yield f"port {port} is free"
        else:
            words = f"port {port} is taken by {_who(taken)}"
            yield PORT_TAKEN.at(None, words, help="choose another one with '--set bus.port=N'")


def _router(robot: RunningRobot, facts: HostFacts) -> Iterator[str | Finding]:
    if robot.state is None or robot.state.router is None or "router" not in robot.state.processes:
        return  # it uses a router from elsewhere, or none is known
    if not robot.state.is_supervised:
        return  # `leftovers` reports that the robot has ended
    if is_private(robot.state.router):
        yield f"the bus of {robot.name} takes programs of this user only"
        return
    router, port = robot.state.processes["router"], int(robot.state.router.rpartition(":")[2])
    taken = facts.listeners.get(port)
    if taken is not None and taken.pid == router.pid:
        yield f"port {port}: router of {robot.name}, open to every user of this machine"
        return
    words = "nothing listens there" if taken is None else f"{_who(taken)} listens there"
    message = f"the router of '{robot.name}' should listen at port {port}, but {words}"
    yield NO_LISTENER.at(None, message, help=f"rbxcompose down {robot.name}")


def _open_to_network(robot: RunningRobot, facts: HostFacts) -> Iterator[str]:
    names = {process.pid: name for name, process in robot.state.processes.items()} if robot.state else {}
    for port, listener in sorted(facts.listeners.items()):
        if listener.is_open and listener.pid in names:
            yield f"port {port}: process {names[listener.pid]} of {robot.name}, open to the network"


def _who(taken: Listener) -> str:
    return "a process of another user" if taken.pid is None else f"'{plain(taken.title)}' (process {taken.pid})"


@examination
def clashes(facts: HostFacts) -> Iterator[str | Finding]:
    """Compare types and hashes of all ends of each name."""
    for robot in (running_robot for running_robot in facts.running if running_robot.bus is not None):
        graph = robot.bus.graph if robot.bus else None
        names = [*graph.topics, *graph.services, *graph.actions] if graph else []
        for name in (name for name in names if name.clash):
            words = f"{plain(name.name)} of '{robot.name}' has {plain(name.clash, 400)}"
            yield CLASH.at(None, words, help=f"'rbxcompose topic show {plain(name.name)}' shows which end has which")
        if not any(name.clash for name in names):
            yield f"{robot.name}: all ends of {len(names)} names agree in their types"


@examination
def clocks(facts: HostFacts) -> Iterator[str | Finding]:
    """Compare the wall clock with a time surely past, with the monotonic clock, and with the stamps of others."""
    clock = facts.clocks
    if clock.wall < clock.oldest:
        words = "the clock of this machine is before the time at which rbxcompose was made"
        yield WRONG_CLOCK.at(None, words, help=_HELP)
    elif abs(clock.step) > MOST_STEP:
        words = f"the clock of this machine moved by {clock.step:+.3f} s while we looked"
        yield WRONG_CLOCK.at(None, words, help=_HELP)
    else:
        yield f"the wall clock runs evenly{_server(clock.is_synchronised)}"
    for robot in facts.running:
        ages = robot.bus.ages if robot.bus else {}
        wrong = {node: age for node, age in ages.items() if not -MOST_AHEAD <= age <= MOST_BEHIND}
        for node, age in sorted(wrong.items()):
            words = f"{-age:.2f} s in the future" if age < 0 else f"{age:.2f} s in the past"
            yield OTHER_CLOCK.at(None, f"the stamps of '{node}' of '{robot.name}' are {words}", help=_HELP)
        if ages and not wrong:
            yield f"{robot.name}: the stamps of {len(ages)} nodes agree with this clock"
        for host, offset in sorted(robot.state.clocks.items()) if robot.state else ():
            words = f"{robot.name}: the clock of host '{host}' is {offset.words}"
            yield HOSTS_DIFFER.at(None, words, help=_HELP) if offset.is_too_far else words


def _server(is_synchronised: bool | None) -> str:
    if is_synchronised is None:
        return ""
    return (
        ", set by a time server" if is_synchronised else "; no time server sets it, which matters with several machines"
    )


@examination
def wires(facts: HostFacts) -> Iterator[str | Finding]:
    """Report the ends of wires that have no partner on the bus of each robot."""
    for robot in facts.running:
        if robot.bus is not None:
            yield from _wires_of(robot, [topic for topic in robot.bus.graph.topics if not topic.is_hidden])


def _wires_of(running_robot: RunningRobot, topics: list[GraphName]) -> Iterator[str | Finding]:
    ends = running_robot.robot.ends if running_robot.robot else ()
    open_inputs = {end.topic for end in ends if isinstance(end.port, In) and end.port.is_open}
    alone = [topic for topic in topics if topic.takers and not topic.givers and topic.name not in open_inputs]
    for topic in alone:
        nodes = ", ".join(sorted({end.node for end in topic.takers}))
        words = f"{plain(nodes)} of '{running_robot.name}' subscribes to {plain(topic.name)}, which has no publisher"
        yield NOBODY_PUBLISHES.at(None, words, help="'rbxcompose topic ls' shows what is published")
    unread = [plain(topic.name) for topic in topics if topic.givers and not topic.takers]
    more = f" and {len(unread) - _MOST_NAMES} more" if len(unread) > _MOST_NAMES else ""
    rest = f"; published without a subscriber: {', '.join(unread[:_MOST_NAMES])}{more}" if unread else ""
    yield f"{running_robot.name}: {len(topics) - len(alone)} topics are published or open to the outside{rest}"
