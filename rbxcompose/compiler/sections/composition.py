"""Sections of which files are composed: arguments, parts with what they need and provide, and profiles."""

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Field, SkipValidation

from rbxcompose.base.config import ARGUMENT, INSTANCE, Config, Name, Refers
from rbxcompose.base.findings import Span
from rbxcompose.manifest.arguments import ArgumentModel, DeclaredArgument, read_argument
from rbxcompose.manifest.fields import FileName, InterfaceName, PieceAttachment, TopicName
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import PART, ROBOT, Reading, SetScope, Short
from rbxcompose.manifest.tree import Entry, MappingNode
from rbxcompose.manifest.validate import validate


@section(
    "args",
    ArgumentModel,
    order=10,
    names=ARGUMENT,
    entry="argument",
    short=Short("default", only_over="the argument's value"),
    is_composed=False,
)
def args(reading: Reading[ArgumentModel]) -> dict[str, tuple[DeclaredArgument | None, Span]]:
    """Arguments by name: what a user of the robot or part may want to set, read by `${args.NAME}`.

    Example:
        args:
          speed:
            type: speed
            default: 0.3 m/s
            min: 5 cm/s
            max: 0.5 m/s
            about: Speed between places.
    """
    return {
        name: (read_argument(name, entry.value, ("args", name), reading.report), entry.key.span)
        for name, entry in reading.named()
    }


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


class Needs(Config):
    """What must exist outside a part."""

    ports: dict[TopicName, InterfaceName] = {}
    """Topics with their types, such as `cmd_vel: geometry_msgs/Twist`."""


@section("needs", Needs, order=130, files=(PART,), scope=SetScope.NOTHING, is_composed=False)
def needs(reading: Reading[Needs]) -> Needs:
    """What must exist outside the part; `check` verifies it."""
    return reading.whole() or Needs()


class Provides(Config):
    """What a part offers to the rest of the robot, under the names in its file."""

    ports: dict[TopicName, InterfaceName] = {}
    """Topics with their types."""
    skills: tuple[Name, ...] = ()
    """Skills of missions."""
    values: tuple[Name, ...] = ()
    """Values that missions read."""


@section("provides", Provides, order=140, files=(PART,), scope=SetScope.NOTHING, is_composed=False)
def provides(reading: Reading[Provides]) -> Provides:
    """What the part offers to the rest of the robot, under the part's own names; `check` verifies it."""
    return reading.whole() or Provides()


PROFILE = "profile"


@section(
    "profiles", dict[str, Any], order=120, files=(ROBOT,), names=PROFILE, scope=SetScope.NOTHING, is_composed=False
)
def profiles(reading: Reading[dict[str, Any]]) -> dict[str, Entry] | None:
    """Changes to the robot by name, applied with `--profile NAME`.

    Example:
        profiles:
          tired:
            components:
              battery:
                runtime: 30 s
            start: !remove
    """
    there = reading.contents.root.get("profiles")
    if there is None:
        return {}
    is_read = validate(dict[Name, dict[str, Any]], there, ("profiles",), reading.report) is not None
    return there.entries if is_read and isinstance(there, MappingNode) else None
