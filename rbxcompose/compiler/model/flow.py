"""How messages flow: publishers and subscribers of a topic, which commands reach which base."""

from collections.abc import Collection, Iterator

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.compiler.model.robot import PortEnd, Robot, RobotComponent
from rbxcompose.manifest.arguments import decided_at
from rbxcompose.manifest.tree import at
from rbxcompose.sdk.capabilities import CommandsMotion, Drives, Forwards
from rbxcompose.sdk.ports import In

OTHER_TYPE = "take another type for one of them"  # the remedy if no setting can be changed


@dataclass(frozen=True, slots=True)
class Drive:
    """A component whose commands reach a base."""

    driver: RobotComponent
    commands: CommandsMotion
    base: RobotComponent
    drives: Drives


@dataclass(frozen=True, slots=True)
class MessageFlow:
    """Which messages of a robot reach which component."""

    robot: Robot

    def upstream(self, end: PortEnd, passed: tuple[PortEnd, ...] = ()) -> Iterator[PortEnd]:
        """Yield all outputs on the way to an input: those of muxes, and those whose messages these may let through."""
        for writer in self.robot.writers.get(end.topic, ()):
            if writer in passed or writer.type_name != end.type_name:
                continue
            yield writer
            for port_end in self._let_through(writer) or ():
                yield from self.upstream(port_end, (*passed, writer))

    def sources(self, end: PortEnd) -> Iterator[PortEnd]:
        """Yield the outputs whose messages reach an input; for a mux, those it may let through."""
        return (port_end for port_end in self.upstream(end) if self._let_through(port_end) is None)

    def _let_through(self, output: PortEnd) -> list[PortEnd] | None:
        """Return the inputs that a mux lets through to an output; None if it is not an output of a mux."""
        component = self.robot.components[output.instance]
        muxed = [forwards.inputs for forwards in component.declared(Forwards) if forwards.output == output.name]
        return [end for end in component.ends if any(end.name in names for names in muxed)] if muxed else None

    def fed_by(self, component: RobotComponent, port: str) -> Iterator[PortEnd]:
        """Yield the outputs whose messages reach an input of a component, directly or through muxes."""
        end = component.end(port)
        yield from self.sources(end) if end else ()

    def drives(self) -> Iterator[Drive]:
        """Yield which component commands which base, directly or through muxes."""
        for base, drives in self.robot.declared(Drives):
            for source in self.fed_by(base, drives.commands):
                driver = self.robot.components[source.instance]
                for motion in driver.declared(CommandsMotion):
                    if motion.commands == source.name:
                        yield Drive(driver, motion, base, drives)


def period_of(component: RobotComponent) -> float | None:
    """Return the time between two messages of a component [s], None if it does not send at its own rate only."""
    listens = any(isinstance(end.port, In) for end in component.ends)
    rate = component.cls.rate_of(component.config)
    return None if listens or rate <= 0 else 1 / rate


def setting(component: RobotComponent, name: str) -> float | None:
    """Return a number from a component's configuration, in SI; None if it is in doubt, or there is no such setting."""
    value = getattr(component.config, name, None) if component.is_sound else None
    return value if isinstance(value, float) else None


def setting_span(robot: Robot, *settings: tuple[RobotComponent, str]) -> Span:
    """Return the place of the first of these settings that is written, else that of the first one's component.

    A setting is the name of a field of the configuration; without one, the value comes from the component's type.
    """
    for component, name in settings:
        if is_written(robot, component, name):
            place = component.place(name)
            return decided_at(robot.manifest.root, place, robot.value(*place))
    component, name = settings[0]
    return robot.component_span(component.name) if name else robot.value(*component.path, "type")


def is_written(robot: Robot, component: RobotComponent, name: str) -> bool:
    """Return whether a field of the configuration is written down in the manifest."""
    return bool(name) and at(robot.manifest.root, component.place(name)) is not None


@dataclass(frozen=True, slots=True)
class Wrong:
    """An error in a source of messages: what may help, and the name in it that is not one of `valid`, if any."""

    message: str
    help: str = ""
    name: str = ""
    valid: Collection[str] = ()
