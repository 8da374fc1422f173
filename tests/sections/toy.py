"""A section of somebody else in one file: lamps, each of which becomes a component."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from rbxcompose.base.config import COMPONENT, Config, Name, PlaceName, Refers
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading, Short, WantedComponent, Wiring
from rbxcompose.msgs.std_msgs import Bool
from rbxcompose.sdk import Component, In, Out, component

LAMP = "lamp"
LampName = Annotated[Name, Refers(LAMP)]


class Lamp(Config):
    """A lamp on the robot."""

    driver: Annotated[Name, Refers(COMPONENT)]
    """The component that switches it."""
    after: tuple[LampName, ...] = ()
    """Lamps that shine before this one."""
    place: PlaceName | None = None
    """Where it hangs."""


class ToyLampConfig(Config):
    """What a lamp is told."""

    after: int = 0
    """How many lamps shine before it."""


@component("toy_lantern")
class ToyLamp(Component[ToyLampConfig]):
    """Shines while it is dark."""

    dark = In(Bool, "dark")
    shines = Out(Bool, "shines")


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    for name, lamp in contents.of(lamps).items():
        yield WantedComponent(name, "toy_lantern", {"after": len(lamp.after)}, ("lamps", name))


@section(
    "lamps", Lamp, names=LAMP, runs=True, entry="lamp", short=Short("driver"), needs="driver", components=_components
)
def lamps(reading: Reading[Lamp]) -> dict[str, Lamp]:
    """Lamps of the robot, by name.

    Example:
        lamps:
          front: base
          rear: {driver: base, after: [front]}
    """
    return reading.entries()
