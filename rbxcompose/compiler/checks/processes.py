"""Rules about processes, restarts, simulation and access."""

from collections.abc import Iterator

from rbxcompose.base.findings import Finding, Related, Severity
from rbxcompose.base.units import TIME, format_quantity
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.manifest.tree import at


@check("RBX3025")
def access_elsewhere(robot: Robot) -> Iterator[Finding]:
    """The access is restricted at a router that is not the robot's own."""
    bus = robot.manifest.bus
    if bus.access == "user" and bus.router is not None:
        yield access_elsewhere.at(
            robot.value("bus", "access"),
            "'access: user' has no effect on an existing router",
            help="remove 'router', or protect that router itself and remove 'access'",
            related=[Related(robot.value("bus", "router"), "the router that decides who takes part")],
        )


@check("RBX8002")
def external_clock(robot: Robot) -> Iterator[Finding]:
    """The real robot must keep its own time."""
    if robot.manifest.is_simulated or robot.manifest.bus.clock != "external":
        return
    yield external_clock.at(
        robot.value("bus", "clock"),
        "the real robot cannot follow the time of a simulator",
        help="run it without '--real', or remove 'clock'",
    )


@check("RBX8001")
def only_simulated(robot: Robot) -> Iterator[Finding]:
    """A component that exists only in simulation cannot run on the real robot."""
    if robot.manifest.is_simulated:
        return
    for component in robot.components.values():
        if component.cls.simulated:
            yield only_simulated.at(
                robot.value(*component.path, "type"),
                f"'{component.name}' exists only in simulation: '{component.type_name}'",
                help="run it without '--real', or use a type for the real device",
            )


WORLD = "world"


@check("RBX6001", Severity.WARNING, closed=())
def world_group(robot: Robot) -> Iterator[Finding]:
    """The process group `world` is for simulated truth only."""
    for component in robot.components.values():
        if component.process == component.cls.process or WORLD not in (component.process, component.cls.process):
            continue
        if component.process == WORLD == robot.manifest.process:
            continue
        if component.cls.process == WORLD:
            message = f"'{component.name}' is simulated and belongs in the group 'world', not in '{component.process}'"
        else:
            message = f"'{component.name}' is not part of the simulated world, but runs in its group"
        is_of_all = component.process == robot.manifest.process
        place = robot.value("process") if is_of_all else robot.value(*component.path, "process")
        yield world_group.at(place, message, help="write 'process: world'" if is_of_all else "remove 'process'")


_LIMITS = ("max", "within", "backoff")


@check("RBX3508", Severity.WARNING, closed=())
def idle_restart(robot: Robot) -> Iterator[Finding]:
    """A limit of restarts that never happen."""
    for component in robot.components.values():
        path = (*component.path, "restart")
        if component.restart.when != "never" or at(robot.manifest.root, path) is None:
            continue
        for key in _LIMITS:
            if at(robot.manifest.root, (*path, key)) is not None:
                message = f"'{key}' changes nothing: '{component.name}' is never restarted"
                yield idle_restart.at(
                    robot.key(*path, key), message, help=f"write 'when: on_failure', or remove '{key}'"
                )


@check("RBX5006", Severity.WARNING)
def shortened_pause(robot: Robot) -> Iterator[Finding]:
    """The pause before a restart is longer than it can be."""
    for component in robot.components.values():
        limits = component.restart
        longest = limits.within / limits.max
        path = (*component.path, "restart", "backoff")
        if limits.when == "on_failure" and limits.backoff > longest and at(robot.manifest.root, path) is not None:
            enough = sum(limits.backoff * 2.0**number for number in range(limits.max - 1))
            wanted, shortened = format_quantity(limits.backoff, TIME), format_quantity(longest, TIME)
            yield shortened_pause.at(
                robot.value(*path),
                f"'{component.name}' never pauses for {wanted}: {shortened} is the longest with which {limits.max} "
                f"failures fit into {format_quantity(limits.within, TIME)}",
                help=f"pauses that double from {wanted} need 'within: {format_quantity(enough, TIME)}' or more, "
                "or a lower 'max'",
            )
