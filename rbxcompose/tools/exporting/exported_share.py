"""What every export needs to know of a share: where it runs, the command that runs it, and what it opens."""

import hashlib
from collections.abc import Iterator, Mapping

from rbxcompose.base.config import Config, Secret
from rbxcompose.base.dataclass import dataclass
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.compiler.systems.certificates import AUTHORITY, CERTIFICATE, KEY, NO_SECURITY
from rbxcompose.compiler.systems.model import System
from rbxcompose.compiler.systems.share import exchange_of, hosts_of, share_of
from rbxcompose.sdk.capabilities import OpensPort
from rbxcompose.sdk.registry import component_type

GRACE = 5.0  # [s] to go down beside the time to come to rest
REFUSED = (1, 2)  # exit codes that another try does not change: findings, wrong usage
MISSION_FAILED = 3
MEMORY, PROCESSES = "1G", 500  # of a share at most; a robot with an arm needs a fifth of it
CERTIFICATES = (AUTHORITY, CERTIFICATE, KEY)
CONFIGURATION = "/run/config"  # in a container: where `CERTIFICATES` are, as in `~/.config`
FILE = "{file}"
LONGEST = 63  # characters of a label in Kubernetes, or of a name there
_DIGITS = 8


def joined_name(*names: str) -> str:
    """Return names joined to one that other programs take: of small letters, digits and '-' within.

    Other names make another one. Since '-' stands between names and for '_', that is so only if no name but the first
    has a '_'; else a number is added that depends on all of them, as to a name that is cut.
    """
    whole = "-".join(names)
    made = whole.replace("_", "-")
    if "_" not in "".join(names[1:]) and not made.endswith("-") and len(made) <= LONGEST:
        return made
    number = int(hashlib.sha256(whole.encode()).hexdigest(), 16) % 10**_DIGITS
    return f"{made[: LONGEST - _DIGITS - 1].rstrip('-')}-{number:0{_DIGITS}}"


@dataclass(frozen=True, slots=True)
class ExportedShare:
    """The share of a host of a robot; `devices` are paths of serial ports, `rest_time` [s] is until it stands still."""

    system: str
    robot: str
    host: str
    command: tuple[str, ...]  # after the program's name; `{file}` stands for the path of the system's file
    devices: tuple[str, ...]
    rest_time: float
    has_certificates: bool = False
    secrets: tuple[str, ...] = ()  # that its manifest refers to

    @property
    def name(self) -> str:
        """Return a name that no other share of the system has."""
        return joined_name(self.robot, self.host)

    @property
    def certificates(self) -> str:
        """Return the folder of its certificates below that of configurations."""
        return f"rbxcompose/systems/{self.system}/{self.host}"


def shares(system: System, host: str | None = None) -> Iterator[ExportedShare]:
    """Yield the shares of a system, or those of one host, in the order of its file."""
    for robot in system.robots.values():
        for other in hosts_of(system, robot):
            if host in (None, other):
                plan = share_of(system, robot, other)
                real = () if plan.is_simulated else ("--real",)
                profiles = tuple(word for name in system.profiles for word in ("--profile", name))
                words = ("up", FILE, "--host", other, "--robot", robot.name, *profiles, *real)
                is_linked = plan.share is not None or exchange_of(system, robot, other) is not None
                yield ExportedShare(
                    system.name,
                    robot.name,
                    other,
                    words,
                    tuple(_devices(plan)),
                    _rest_time(plan),
                    is_linked and system.security != NO_SECURITY,
                    tuple(sorted({name for each in plan.instances for name in _secrets(each.config)})),
                )


def _devices(plan: Plan) -> list[str]:
    opened = (component_type(instance.type).capabilities(instance.config) for instance in plan.instances)
    paths = {each.port.value for capabilities in opened for each in capabilities if isinstance(each, OpensPort)}
    return sorted(path for path in paths if path.startswith("/dev/"))


def _secrets(value: object) -> Iterator[str]:
    """Yield the names of all secrets in a configuration."""
    match value:
        case Secret():
            yield value.name
        case Config():
            yield from (name for _, one in value for name in _secrets(one))
        case Mapping():
            yield from (name for entry in value.values() for name in _secrets(entry))
        case tuple():
            yield from (name for item in value for name in _secrets(item))


def _rest_time(plan: Plan) -> float:
    return max((component_type(instance.type).rest_time(instance.config) for instance in plan.instances), default=0.0)
