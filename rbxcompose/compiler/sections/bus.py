"""Sections about messages: how they travel, and types of them of the robot's own."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from rbxcompose.base.config import Config
from rbxcompose.base.findings import Report
from rbxcompose.bus.endpoints import endpoint
from rbxcompose.manifest.documents import Documents
from rbxcompose.manifest.fields import FileName, TopicName
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import OVERLAY, ROBOT, Contents, Reading, Short
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.msgs import registry


class BusModel(Config):
    """How the robot's messages travel."""

    domain: int = Field(0, ge=0, le=232)
    """ROS domain; robots of different domains do not see each other."""
    namespace: TopicName | None = None
    """Prefix of all relative topics."""
    port: int = Field(7447, ge=1, le=65535)
    """TCP port of the robot's router; if it is in use, the next free one."""
    wire: Literal["jazzy"] = "jazzy"
    """The ROS 2 distribution whose wire format is spoken."""
    access: Literal["machine", "user"] = "machine"
    """Who may take part through the robot's own router: every program of this machine, or those of this user only, by
    Unix sockets instead of the port."""
    router: Annotated[str, AfterValidator(endpoint)] | None = None
    """An existing router to use instead of the robot's own, such as `tcp/192.168.0.2:7447`."""
    links: Literal["direct", "router"] = "direct"
    """Whether processes send to each other directly, or by that `router` only. Directly is faster, and goes on without
    the router; but then each process at the router has a link to each other one, also of other robots."""
    clock: Literal["own", "external"] = "own"
    """Whose time the robot follows: its own, or that of an external simulator, which publishes it on `/clock`."""

    @model_validator(mode="after")
    def _links_by_an_existing_router(self) -> Self:
        if self.links == "router" and self.router is None:
            raise ValueError("'links: router' needs 'router', an existing router for many robots")
        return self


@section("bus", BusModel, order=100, files=(ROBOT, OVERLAY))
def bus(reading: Reading[BusModel]) -> BusModel:
    """How its messages travel.

    Example:
        bus:
          domain: 7
          namespace: robot_1
          port: 7447
    """
    return reading.whole() or BusModel()


FOLDER = "folder of messages"


class MessageFolder(Config):
    """A folder with types of messages, services and actions."""

    folder: FileName
    """A ROS package: its name is that of the package, and its files are below `msg/`, `srv/` and `action/`. Or a folder
    with such packages."""


@section("msgs", MessageFolder, order=25, names=FOLDER, entry="folder", short=Short("folder"))
def msgs(reading: Reading[MessageFolder]) -> Mapping[str, str]:
    """Folders with message types of the robot's own, by any name; their texts are those of ROS 2.

    Example:
        msgs:
          own: msgs                       # a folder beside this file
    """
    folders = {name: read.folder for name, read in reading.entries().items()}
    if not folders:
        return {}
    from rbxcompose.compiler.message_texts import texts_in  # few robots have such types

    return texts_in(folders, reading)


def foresee(root: MappingNode, file: Path) -> None:
    """Let names also mean the types of a file that is not composed yet: components that it names may import them."""
    if msgs.name in root:
        own = Contents(root, file, Documents(Report(), {})).of(msgs)
        registry.choose({**registry.chosen().texts, **own})
