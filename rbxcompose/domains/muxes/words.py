"""The words with which a manifest describes a mux."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag

from rbxcompose.base.config import Acceleration, AngularAcceleration, Config, Live, Time

MuxMode = Literal["priority", "select", "latest"]
MuxProfile = Literal["default", "topic_tools", "twist_mux", "yocs"]

MODE_OF: dict[MuxProfile, MuxMode] = {
    "default": "priority",
    "topic_tools": "select",
    "twist_mux": "priority",
    "yocs": "priority",
}
"""The mode that a profile has if none is given; only the default profile has others, too."""

HIGHEST = 255
"""The highest priority of twist_mux."""
OWN_NAMES = frozenset({"output", "announced", "active", "selected", "select", "add", "delete", "list"})
"""Names that a mux needs itself, below its topic or among its ports; so are those that begin with `lock_`."""


class HoldFirst(Config):
    """The last command stays in force for a while, then a stop follows."""

    hold: Time = Field(gt=0)
    """How long until the stop. Nothing is repeated, so a receiver that brakes by itself may do so earlier."""


def _form(value: object) -> str:
    return "word" if isinstance(value, str) else "hold"


MuxEnding = Annotated[
    Annotated[Literal["none", "stop"], Tag("word")] | Annotated[HoldFirst, Tag("hold")], Discriminator(_form)
]


class HandoverLimits(Config):
    """How fast the output may grow from what one source commanded to what the next one commands."""

    linear: Annotated[Acceleration | None, Live()] = Field(None, gt=0)
    """For each axis; without it, it is not limited."""
    angular: Annotated[AngularAcceleration | None, Live()] = Field(None, gt=0)
    """For each axis; without it, it is not limited."""


def mode_of(mode: MuxMode | None, profile: MuxProfile) -> MuxMode:
    """Return the mode of a mux, which may be left out."""
    return mode or MODE_OF[profile]
