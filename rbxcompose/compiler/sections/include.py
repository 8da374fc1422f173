"""The section `include`: the parts of a robot."""

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Field, SkipValidation

from rbxcompose.base.config import INSTANCE, Config, Name, Refers
from rbxcompose.manifest.fields import FileName, PieceAttachment, TopicName
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Reading, Short
from rbxcompose.manifest.tree import Entry

PART_ARGUMENT = "part argument"
"""An argument of the instance's part."""


class Include(Config):
    """An instance of a part."""

    part: FileName
    """The part's file, relative to this one, or `rbx:parts/NAME.yaml` of the library."""
    with_: dict[Annotated[Name, Refers(PART_ARGUMENT, is_reported=True)], Any] = Field({}, alias="with")
    """Values of its arguments, by name."""
    connect: dict[TopicName, TopicName] = {}
    """Other names for its topics: those of its ports, of its muxes, and `MUX/INPUT` of a mux's inputs."""
    attach: Annotated[PieceAttachment | None, SkipValidation] = None  # read as that of the piece, when it is filled in
    """The link that carries the part's piece of the body, and where; without it, the piece is the base."""


@section(
    "include", Include, order=20, names=INSTANCE, entry="part", short=Short("part"), needs="part", is_composed=False
)
def include(reading: Reading[Include]) -> Iterator[tuple[str, Entry, Include | None]]:
    """The robot's parts, by instance name, which is a prefix of all names of the part.

    Example:
        include:
          lift:
            part: rbx:parts/battery.yaml
            with:
              dock: dock
              runtime: 90 s
            connect:
              battery_level: lift/battery_level
              set_battery_level: lift/set_battery_level
              recharge: recharge_lift
    """
    for name, entry in reading.named():
        yield name, entry, reading.valid(Include, name, entry.value)
