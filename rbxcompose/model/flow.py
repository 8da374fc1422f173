"""How messages flow: publishers and subscribers of a topic, which commands reach which base, how often."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from rbxcompose.findings import Span
from rbxcompose.manifest.tree import at
from rbxcompose.model.robot import Part, Robot
from rbxcompose.model.wires import End
from rbxcompose.sdk.capabilities import CommandsMotion, Drives, Forwards
from rbxcompose.sdk.ports import In

OTHER_TYPE = "take another type for one of them"  # the remedy where no setting can be changed


@dataclass(frozen=True, slots=True)
class Drive:
    """A part whose commands reach a base."""

    driver: Part
    commands: CommandsMotion
    base: Part
    drives: Drives


@dataclass(frozen=True, slots=True)
class Flow:
    """Which messages of a robot reach whom."""

    robot: Robot

    def sources(self, end: End, passed: tuple[End, ...] = ()) -> Iterator[End]:
        """Yield the outputs whose messages reach an input; of a mux, those that it may let through."""
        for writer in self.robot.writers.get(end.topic, ()):
            if writer in passed or writer.type_name != end.type_name:
                continue
            inputs = self._let_through(writer)
            if inputs is None:
                yield writer
            for one in inputs or ():
                yield from self.sources(one, (*passed, writer))

    def _let_through(self, output: End) -> list[End] | None:
        """Return the inputs that a mux lets through to an output; None if it is no output of a mux."""
        part = self.robot.parts[output.instance]
        muxed = [one.inputs for one in part.declared(Forwards) if one.output == output.name]
        return [end for end in part.ends if any(end.name in names for names in muxed)] if muxed else None

    def fed_by(self, part: Part, port: str) -> Iterator[End]:
        """Yield the outputs whose messages reach an input of a part, through muxes."""
        end = part.end(port)
        yield from self.sources(end) if end else ()

    def drives(self) -> Iterator[Drive]:
        """Yield who commands which base, also through muxes."""
        for base, drives in self.robot.declared(Drives):
            for source in self.fed_by(base, drives.commands):
                driver = self.robot.parts[source.instance]
                for one in driver.declared(CommandsMotion):
                    if one.commands == source.name:
                        yield Drive(driver, one, base, drives)


def period_of(part: Part) -> float | None:
    """Return the time between two messages of a part [s], if it sends at its own rate only."""
    listens = any(isinstance(end.port, In) for end in part.ends)
    return None if listens or part.cls.rate <= 0 else 1 / part.cls.rate


def setting(part: Part, name: str) -> float | None:
    """Return a number of a part's configuration, in SI; None if its type has none of this name."""
    value = getattr(part.config, name, None)
    return value if isinstance(value, float) else None


def setting_span(robot: Robot, *settings: tuple[Part, str]) -> Span:
    """Return the place of the first of these settings that is written down, else that of the first one's part.

    A setting is the name of a field of the configuration; without one the value is that of the part's type.
    """
    for part, name in settings:
        if is_written(robot, part, name):
            return robot.value(*part.path, *name.split("."))
    part, name = settings[0]
    return robot.part_span(part.name) if name else robot.value(*part.path, "type")


def is_written(robot: Robot, part: Part, name: str) -> bool:
    """Return whether a field of the configuration is written down in the manifest."""
    return bool(name) and at(robot.manifest.root, (*part.path, *name.split("."))) is not None
