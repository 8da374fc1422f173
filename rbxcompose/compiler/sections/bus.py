"""The section `bus`: how messages travel."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from rbxcompose.base.config import Config
from rbxcompose.bus.endpoints import endpoint
from rbxcompose.manifest.fields import TopicName
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import OVERLAY, ROBOT, Reading


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
