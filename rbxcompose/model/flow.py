"""How messages flow through a robot: who speaks and listens on a topic, which commands reach which base, how often."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from rbxcompose.findings import Span
from rbxcompose.manifest.tree import at
from rbxcompose.model.robot import Part, Robot
from rbxcompose.model.wiring import End
from rbxcompose.sdk.ports import In

MUX = "mux"


@dataclass(frozen=True, slots=True)
class Flow:
    """Which messages of a robot reach whom."""

    robot: Robot

    def sources(self, end: End) -> Iterator[End]:
        """Yield the outputs whose messages reach an input; of a mux, those that it may let through."""
        for writer in self.robot.writers.get(end.topic, ()):
            part = self.robot.parts[writer.instance]
            if part.type_name != MUX:
                yield from [writer] if writer.type_name == end.type_name else []
                continue
            for own in part.ends:
                if isinstance(own.port, In) and own.type_name == writer.type_name:
                    yield from self.sources(own)

    def fed_by(self, part: Part) -> Iterator[tuple[End, Part]]:
        """Yield each input of a part with a part that feeds it, through muxes."""
        for end in part.ends:
            if isinstance(end.port, In):
                for source in self.sources(end):
                    yield end, self.robot.parts[source.instance]

    def drives(self) -> Iterator[tuple[Part, Part]]:
        """Yield each part that has a speed of its own with each base, with limits, that its commands reach."""
        for base in self.robot.parts.values():
            if setting(base, "max_speed") is None:
                continue
            for _, driver in self.fed_by(base):
                if setting(driver, "speed") is not None:
                    yield driver, base


def period_of(part: Part) -> float | None:
    """Return the time between two messages of a part [s], if it sends at its own rate only."""
    listens = any(isinstance(end.port, In) for end in part.ends)
    return None if listens or part.cls.rate <= 0 else 1 / part.cls.rate


def setting(part: Part, name: str) -> float | None:
    """Return a number of a part's configuration, in SI; None if its type has none of this name."""
    value = getattr(part.config, name, None)
    return value if isinstance(value, float) else None


def setting_span(robot: Robot, *settings: tuple[Part, str]) -> Span:
    """Return the place of the first of these settings that is written down, else that of the first one's part."""
    for part, name in settings:
        if at(robot.manifest.root, (*part.path, name)) is not None:
            return robot.value(*part.path, name)
    return robot.part_span(settings[0][0].name)
