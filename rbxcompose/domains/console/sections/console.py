"""The section `console`: the page that the robot serves."""

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import Field

from rbxcompose.base.config import AngularSpeed, Config, Speed
from rbxcompose.compiler.model.robot import PortEnd, RobotComponent, resolve
from rbxcompose.compiler.model.values import value_of
from rbxcompose.compiler.sections.bus import bus
from rbxcompose.compiler.sections.values import places, values
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.console.checks import PICTURES
from rbxcompose.manifest.fields import TopicName
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import OVERLAY, ROBOT, Contents, Reading, WantedComponent, Wiring
from rbxcompose.manifest.tree import MappingNode, ScalarNode, TreeNode
from rbxcompose.sdk.capabilities import TELEOP, Drives, Forwards, Setting
from rbxcompose.sdk.ports import Out

GATEWAY = "gateway"
FOXGLOVE_PORT = 8765
_VELOCITIES = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")


PageName = Literal[
    "data", "diagnostics", "drive", "fleet", "log", "map", "mission", "model", "mux", "parameters", "robot"
]


class DrivePage(Config):
    """How people drive from the page."""

    topic: TopicName | None = None
    """Where velocities go. Default: the input `teleop` of the mux before the base, else what the base follows."""
    camera: TopicName | None = None
    """The component, or the topic, whose pictures drivers see. Default: the first that publishes pictures."""
    max_speed: Speed | None = Field(None, gt=0)
    """The fastest that the page may drive. Default: the limit of the base."""
    max_turn_rate: AngularSpeed | None = Field(None, gt=0)
    """The fastest that the page may turn. Default: the limit of the base."""


class ConsoleModel(Config):
    """The page that the robot serves."""

    listen: Literal["local", "lan"] = "local"
    """Who may open it: programs of this machine, or with `lan` also others in the network, by a link with a token."""
    origins: list[Annotated[str, Field(pattern=r"^https?://[^/\s]+$")]] = []
    """Pages of other servers that may talk to it, such as `http://localhost:8181`."""
    guard: dict[Annotated[str, Field(pattern=r"^/\S+$")], Literal["view", "operate", "configure"]] = {}
    """The role that visitors need at least for topics, services and actions, by patterns: `/right_arm/*: configure`."""
    port: int = Field(8080, ge=1, le=65535)
    """TCP port of the page."""
    pages: list[PageName] = []
    """Which pages there are, in this order. Default: all."""
    first_page: PageName = "drive"
    """The page that is shown first; if there is none of this name, the first one is."""
    drive: DrivePage = DrivePage()
    """How people drive from the page."""
    foxglove: bool | Annotated[int, Field(ge=1, le=65535)] = False
    """Whether Foxglove and Lichtblick on this machine find the robot at port 8765, or at which port."""


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    if (read := contents.of(console)) is None:
        return
    name, about = (_text(contents.root, key) for key in ("name", "about"))
    components: Mapping[str, RobotComponent] = wiring.components
    namespace = contents.of(bus).namespace or ""
    config = {
        "robot": name,
        "about": about,
        **{key: getattr(read, key) for key in ("port", "listen", "origins", "guard", "pages", "first_page")},
        "foxglove": FOXGLOVE_PORT if read.foxglove is True else int(read.foxglove),
        **_drive(read.drive, components, namespace),
        "camera": _camera(read.drive.camera, components, namespace),
        "values": _values(contents, components, namespace),
        "places": _places(contents),
        **_body(contents),
    }
    yield WantedComponent(GATEWAY, GATEWAY, config, ("console",))


def _text(node: TreeNode | None, key: str) -> str:
    """Return what is written at a key; empty if nothing is."""
    value = node.get(key) if isinstance(node, MappingNode) else None
    return value.text if isinstance(value, ScalarNode) else ""


def _places(contents: Contents) -> dict[str, object]:
    """Return the places of the robot."""
    return {
        name: {"x": place.x, "y": place.y, "heading": place.heading, "colour": place.colour}
        for name, place in contents.of(places).items()
    }


def _body(contents: Contents) -> dict[str, object]:
    """Return the description that is published, and its mesh files; nothing if the robot has no body."""
    if (found := contents.of(body)) is None:
        return {}
    return {"urdf": found.published, "meshes": {name: str(path) for name, path in found.meshes.items()}}


def _drive(page: DrivePage, components: Mapping[str, RobotComponent], namespace: str) -> dict[str, object]:
    """Return where velocities go, and the limits of the first base that follows them; nothing if none does."""
    for component in components.values():
        for drives in component.declared(Drives):
            if (end := component.end(drives.commands)) is not None and end.type_name in _VELOCITIES:
                topic = resolve(page.topic, namespace) if page.topic else _free(components, end)
                limits = {"max_speed": drives.max_speed, "max_turn_rate": drives.max_turn_rate}
                most = {name: _least(getattr(page, name), limit) for name, limit in limits.items()}
                aliases = sorted(_on_the_way(components, end) - {topic})
                return {"drive_topic": topic, "drive_type": end.type_name, "drive_aliases": aliases, **most}
    return {}


def _camera(written: str | None, components: Mapping[str, RobotComponent], namespace: str) -> str:
    """Return the topic of the pictures that drivers see: that of a component, else as written; by default the first.

    One of depths, which has ROS's names, is taken only if the component has no other.
    """
    for name, component in components.items():
        ends = (end for end in component.ends if isinstance(end.port, Out) and end.type_name in PICTURES)
        shown = sorted((end.topic for end in ends), key=lambda topic: "depth" in topic.split("/"))
        if shown and written in (None, name):
            return shown[0]
    return resolve(written, namespace) if written else ""


def _free(components: Mapping[str, RobotComponent], driven: PortEnd) -> str:
    """Return the topic of the input `teleop` of the mux that commands this end, else its own topic."""
    for mux, forwards in _muxes(components, driven):
        if (teleop := mux.end(TELEOP)) and TELEOP in forwards.inputs:
            return teleop.topic
    return driven.topic


def _on_the_way(components: Mapping[str, RobotComponent], driven: PortEnd) -> set[str]:
    """Return the topics by which velocities come to this end: its own, and those of the inputs of its mux."""
    found = {driven.topic}
    for mux, forwards in _muxes(components, driven):
        inputs = filter(None, map(mux.end, forwards.inputs))
        found |= {end.topic for end in inputs if end.type_name == driven.type_name}
    return found


def _muxes(components: Mapping[str, RobotComponent], driven: PortEnd) -> Iterator[tuple[RobotComponent, Forwards]]:
    """Yield the muxes that command this end."""
    for mux in components.values():
        for forwards in mux.declared(Forwards):
            if (output := mux.end(forwards.output)) is not None and output.topic == driven.topic:
                yield mux, forwards


def _least(written: float | None, of_base: Setting[float] | None) -> float:
    return min(math.inf if written is None else written, math.inf if of_base is None else of_base.value)


def _values(contents: Contents, components: Mapping[str, RobotComponent], namespace: str) -> dict[str, object]:
    """Return where the values of the manifest come from, those whose source exists; the unit is that of the message."""
    ends = [end for component in components.values() for end in component.ends]
    types = {end.topic: end.type_name for end in reversed(ends) if end.type_name}
    found: dict[str, object] = {}
    for name, entry in contents.of(values).items():
        if (source := value_of(entry, components, types, namespace, {})) is not None:
            units = [getattr(end.port, "unit", "") for end in ends if end.topic == source.topic]
            unit = entry.unit or next(filter(None, units), "")
            found[name] = {"topic": source.topic, "type": source.message, "field": source.field, "unit": unit}
    return found


@section("console", ConsoleModel, files=(ROBOT, OVERLAY), brings=(GATEWAY,), components=_components)
def console(reading: Reading[ConsoleModel]) -> ConsoleModel | None:
    """The page that the robot serves, with a gateway for clients of rosbridge; `console: {}` is enough.

    Example:
        console:
          port: 8080
          drive:
            max_speed: 0.3 m/s
    """
    return reading.whole()
