"""The keys of a system's file, and the models of its sections."""

import re
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from rbxcompose.base.config import BitRate, Config, Frequency, Name, Time, require_possible
from rbxcompose.manifest.documents import ManifestHeader
from rbxcompose.manifest.fields import FileName

_SSH = re.compile(r"(ssh://)?([A-Za-z0-9_][A-Za-z0-9_.-]*@)?[A-Za-z0-9\[][A-Za-z0-9.:\]_-]*")
_COMMAND = re.compile(r"[A-Za-z0-9_./][A-Za-z0-9_./+-]*")
_ADDRESS = re.compile(r"[0-9A-Fa-f:.]{2,45}|[A-Za-z0-9]([A-Za-z0-9.-]{0,252}[A-Za-z0-9])?")


def _address(text: str) -> str:
    """Read an address or a name of a machine."""
    if not _ADDRESS.fullmatch(text):
        raise ValueError("must be an address or the name of a machine, such as 10.42.0.2 or robot.local")
    return require_possible(text)


def _ssh(text: str) -> str:
    """Read what one types after `ssh`, but no options: with those, a text of others could run programs here."""
    if not _SSH.fullmatch(text):
        raise ValueError("must be a host as one types it after ssh, such as pi@robot; options go to ~/.ssh/config")
    host = text.removeprefix("ssh://").rpartition("@")[2]
    require_possible(host.partition(":")[0] if host.count(":") == 1 else host)
    return text


def _command(text: str) -> str:
    """Read the path of a program."""
    if not _COMMAND.fullmatch(text):
        raise ValueError("must be the path of a program, such as /home/pi/venv/bin/rbxcompose")
    return text


def _in_full(value: object) -> object:
    return {} if value is None else value


def _in_row(value: object) -> object:
    return (value,) if isinstance(value, str) else value


class SystemFile(ManifestHeader):
    """Robots on several hosts: the hosts, the robots, and which host runs what."""

    hosts: Any = None
    """The machines, by name."""
    robots: Any = None
    """The robots that run on them, by name; this is the name that `ps` and other verbs know."""
    links: Any = None
    """What is known of the ways between hosts, by name."""
    world: FileName = ""
    """The simulated world of all robots with a `spawn`: a file of the kind `World`, relative to this one, or
    `rbx:worlds/NAME`. They see each other, and cannot drive through each other."""
    profiles: Any = None
    """Changes to the system by name, applied with `--profile NAME`: a site, a shift, another host."""
    security: Literal["none", "tls", "mtls"] = "none"
    """How routers of different hosts trust each other: not at all; by `tls`, the one that dials knows that the other
    is of this system, and what crosses is encrypted; by `mtls`, both know. `security init` makes the certificates."""


class HostModel(Config):
    """A machine that runs a share of the robots."""

    address: Annotated[str, AfterValidator(_address)] | None = None
    """Where the other hosts reach it: an IP address or a name. Of two hosts of one robot, at least one needs it."""
    ssh: Annotated[str, AfterValidator(_ssh)] | None = None
    """What one types after `ssh` to reach it, such as `pi@robot`. Without it, this is the machine of the command."""
    command: Annotated[str, AfterValidator(_command)] = "rbxcompose"
    """Its program `rbxcompose`, if that is not in the path of commands over ssh."""
    labels: tuple[Name, ...] = ()
    """What robots may call it by in `on` and `place`, such as `gpu`."""
    devices: tuple[str, ...] = ()
    """Serial ports that are connected here, as components name them: `/dev/ttyUSB0`, `usb:0403:6014`, `dev:NAME`."""
    optional: bool = False
    """Whether the others start without it."""


class SystemRobotModel(Config):
    """A robot of the system, and which host runs what of it."""

    robot: str
    """The robot's file, relative to this one, or `rbx:robots/NAME`."""
    profile: Name | None = None
    """A profile of the robot."""
    on: Name | None = None
    """The host, or a label of hosts, for all that `place` does not mention. Without it, components are placed by
    their devices, and the rest goes to the host that has most of the robot by then."""
    place: dict[str, Name] = {}
    """The host, or a label of hosts, for single components, or for parts with all that they bring."""
    stop_within: Annotated[Time, Field(gt=0)] = 1.5
    """The longest time from a cut link until a base stands still that is commanded across it. `plan` shows the time
    that it takes, from the base's settings; `check` refuses a base that takes longer."""
    instances: Annotated[int, Field(ge=1, le=1000)] = 1
    """How many of it there are, as NAME_1, NAME_2 and so on; `on` and `place` with a label take its hosts in turn."""
    spawn: Annotated[tuple[Name, ...], BeforeValidator(_in_row, json_schema_input_type=Name | tuple[Name, ...])] = ()
    """Where the robot is put in the system's `world`: a name in `spawn` of that file. `instances` take several in
    turn."""
    labels: tuple[Name, ...] = ()
    """What `fleet` may call it by, with others."""
    share: tuple[str, ...] = ()
    """Topics that other robots of the system may see, below the name of this one: `map` as `/NAME/map`; services and
    actions that its `callers` may use, in the same way."""
    callers: tuple[Name, ...] = ()
    """Robots of the system that may call the services in `share` and send goals to the actions in it: their names, or
    labels. Whoever may do that may move this robot."""
    share_port: int | None = Field(None, ge=1, le=65535)
    """The TCP port at which other robots fetch what is shared; without it, that of the links plus 1000."""
    link_port: int | None = Field(None, ge=1, le=65535)
    """The TCP port at which the robot's routers reach each other; without it, that of `bus.port` of the robot."""


PRIORITIES = ("high", "medium", "low")


class LinkModel(Config):
    """The way between two hosts."""

    between: tuple[Name, Name]
    """The two hosts."""
    limit: Annotated[BitRate, Field(gt=0)] | None = None
    """What it carries; `check` warns if what is known to cross needs more. Messages of states and of bulk that would
    take it for longer than a second are left out."""
    protocol: Literal["tcp", "quic"] = "tcp"
    """By which the routers talk. QUIC recovers faster from loss and from a new address of a host; it needs `security`,
    and UDP at the port of the link."""
    priorities: dict[str, Literal["high", "medium", "low"]] = {}
    """Which topics go first when the link is full: `high` is that of states, `medium` of latched messages, `low` waits
    for all others. Commands are above all of them. Of several links of a host, the highest counts."""
    downsample: dict[str, Annotated[Frequency, Field(gt=0)]] = {}
    """Topics of which no more messages than these cross; the others are left out. Commands cannot be left out. A host
    with several links sends a topic on all of them as often as the fastest of them asks for."""


ShortHost = Annotated[HostModel, BeforeValidator(_in_full, json_schema_input_type=HostModel | None)]
SECTIONS = {"hosts": dict[Name, ShortHost], "robots": dict[Name, SystemRobotModel]}
LINKS = {"links": dict[Name, LinkModel]}
PROFILES = {"profiles": dict[Name, dict[str, Any]]}
"""Content of each section; a system need not have links or profiles."""
