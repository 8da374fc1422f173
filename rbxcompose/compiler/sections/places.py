"""The section `places`: named poses."""

from collections.abc import Mapping
from typing import cast

from rbxcompose.base.config import PLACE, Angle, Config, Length, Place
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Reading


class PlaceModel(Config):
    """A named pose in `map`."""

    x: Length
    """Position along x."""
    y: Length
    """Position along y."""
    heading: Angle = 0.0
    """Direction, measured from x towards y: 90 deg is along y."""
    colour: str = ""
    """How viewers draw it."""


def _details(read: Mapping[str, Place]) -> dict[str, str]:
    return {name: f"({place.x:g} m, {place.y:g} m)" for name, place in read.items()}


def unknown_place(name: str) -> Place:
    """Return what stands for a place that could not be read."""
    return Place(name, 0.0, 0.0, 0.0)


@section("places", PlaceModel, order=70, names=PLACE, entry="place", stand_in=unknown_place, details=_details)
def places(reading: Reading[PlaceModel]) -> dict[str, Place]:
    """Places by name: poses in `map`, to which missions refer. A robot in a `world` has the places of that, too.

    Example:
        places:
          window: {x: 2 m, y: -50 cm, heading: 90 deg, colour: blue}
    """
    found = cast("dict[str, Place]", reading.contents.brought(PLACE))
    for name, entry in reading.named():
        # A place with mistakes becomes the origin, so that references to it are not wrong as well.
        read = reading.valid(PlaceModel, name, entry.value) or PlaceModel(x=0.0, y=0.0)
        found[name] = Place(name, read.x, read.y, read.heading, read.colour)
    return found
