"""What listens at the ports of routers."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.findings import Finding, Severity, kind
from rbxcompose.base.printable import plain
from rbxcompose.bus.endpoints import is_private
from rbxcompose.compiler.sections.bus import BusModel
from rbxcompose.tools.doctor import HostFacts, Listener, RunningRobot, examination

PORT_TAKEN = kind("RBX9402", Severity.WARNING)
NO_LISTENER = kind("RBX9403")


@examination
def ports(facts: HostFacts) -> Iterator[str | Finding]:
    """Check the routers of robots that are up, and the port that the named robot needs."""
    for robot in facts.running:
        yield from _router(robot, facts)
    names = {running_robot.name for running_robot in facts.running}
    if facts.file is None:
        wanted = [] if facts.running else [BusModel().port]
    else:
        bus = facts.file.manifest.bus
        needs_none = facts.file.manifest.name in names or bus.router or bus.access == "user"
        wanted = [] if needs_none else [bus.port]
    for port in wanted:
        taken = facts.listeners.get(port)
        yield (
            f"port {port} is free"
            if taken is None
            else PORT_TAKEN.at(
                None, f"port {port} is taken by {_who(taken)}", help="choose another one with '--set bus.port=N'"
            )
        )


def _router(robot: RunningRobot, facts: HostFacts) -> Iterator[str | Finding]:
    if robot.state is None or robot.state.router is None or "router" not in robot.state.processes:
        return  # it uses a router from elsewhere, or none is known
    if not robot.state.is_supervised:
        return  # that the robot has ended is told by `leftovers`
    if is_private(robot.state.router):
        yield f"the bus of {robot.name} takes programs of this user only"
        return
    router, port = robot.state.processes["router"], int(robot.state.router.rpartition(":")[2])
    taken = facts.listeners.get(port)
    if taken is not None and taken.pid == router.pid:
        yield f"port {port}: router of {robot.name}, open to every user of this machine"
        return
    words = "nothing listens there" if taken is None else f"{_who(taken)} listens there"
    yield NO_LISTENER.at(
        None,
        f"the router of '{robot.name}' should listen at port {port}, but {words}",
        help=f"rbxcompose down {robot.name}",
    )


def _who(taken: Listener) -> str:
    return "a process of another user" if taken.pid is None else f"'{plain(taken.title)}' (process {taken.pid})"
