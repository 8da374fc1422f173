"""What a controller is: it leads joints, once in each cycle of the bus that drives them."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, Protocol, Self, TypeVar, get_args

from pydantic import PrivateAttr

from rbxcompose.base.config import Config
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.plugins import Plugins
from rbxcompose.base.units import ANGLE, LENGTH, Dimension
from rbxcompose.sdk.bound import ActionServer, ServedGoal
from rbxcompose.sdk.capabilities import Capability
from rbxcompose.sdk.ports import Port

if TYPE_CHECKING:  # `check` needs none of them
    from rbxcompose.base.geometry import Pose2
    from rbxcompose.domains.servos.joint_drive import JointDrive
    from rbxcompose.domains.servos.servo_cycle import ServoItem
    from rbxcompose.sdk.component import Context

PLUGINS = Plugins("controller", "controllers")
_TYPES: dict[str, type[Controller[Any]]] = {}


@dataclass(frozen=True, slots=True)
class UsedItem:
    """An item of a servo that a controller reads or writes; `field` is where the configuration names it."""

    actuator: str
    item: str
    field: str
    is_written: bool


class ControllerConfig(Config):
    """What every controller can be given; a subclass names its joints, by fields of the type `JointName`."""

    type: str
    """How it leads its joints."""
    start: Literal["active", "inactive"] = "active"
    """Whether it leads its joints from the start, or waits until it is switched on."""

    _sliding: frozenset[str] = PrivateAttr(default=frozenset())

    @property
    def claimed(self) -> tuple[str, ...]:
        """Return the joints that it leads."""
        raise NotImplementedError

    @property
    def used(self) -> tuple[UsedItem, ...]:
        """Return the items of servos that it uses itself."""
        return ()

    @property
    def dimensions(self) -> dict[str, Dimension]:
        """Return what the positions of its joints measure: angles, or lengths of those that slide."""
        return {joint: LENGTH if joint in self._sliding else ANGLE for joint in self.claimed}

    def with_sliding(self, joints: Iterable[str]) -> Self:
        """Return it for a robot of whose joints these slide."""
        made = self.model_copy()
        made._sliding = frozenset(joints)
        return made


C = TypeVar("C", bound=ControllerConfig)
T = TypeVar("T", bound="type[Controller[Any]]")


class ControllerHost(Protocol):
    """The component that runs controllers, as their sites see it."""

    bound: dict[str, Any]
    context: Context

    @property
    def now(self) -> float:
        """Return robot time [s]."""

    @property
    def stamp(self) -> int:
        """Return the time for message headers [ns]."""

    def warn(self, text: str) -> None:
        """Log something that a person should look at."""

    def objection(self, controller: str) -> str:
        """Return why a controller may command nothing now, or nothing."""

    def item(self, actuator: str, name: str, *, is_read: bool, setup: Mapping[str, int]) -> ServoItem:
        """Return an item of a servo."""

    def keep(self, controller: str, memory: object) -> None:
        """Give a controller this frozen dataclass again, as data, when it starts again."""


class ControllerSite:
    """What a controller uses of the component that runs it; `start` is where the odometry of a base begins."""

    def __init__(self, bus: ControllerHost, name: str, joints: Mapping[str, JointDrive], start: Pose2) -> None:
        self._bus, self._name, self.joints, self.start = bus, name, joints, start

    @property
    def now(self) -> float:
        """Return robot time [s]."""
        return self._bus.now

    @property
    def stamp(self) -> int:
        """Return the time for message headers [ns]."""
        return self._bus.stamp

    @property
    def refusal(self) -> str:
        """Return why nothing may be commanded now, or nothing."""
        return self._bus.objection(self._name)

    def item(self, actuator: str, name: str, *, is_read: bool, setup: Mapping[str, int]) -> ServoItem:
        """Return an item of a servo; what it needs in other items is written before. Only `prepare` may ask."""
        return self._bus.item(actuator, name, is_read=is_read, setup=setup)

    def action(self, port: str) -> ActionServer[Any, Any, Any]:
        """Return the action at one of the controller's ports."""
        server: ActionServer[Any, Any, Any] = self._bus.bound[f"{self._name}_{port}"]
        return server

    def goal(self, port: str) -> ServedGoal[Any, Any, Any] | None:
        """Return the current goal at one of the controller's ports."""
        return self.action(port).current

    def send(self, port: str, message: Any) -> None:
        """Publish at one of the controller's ports."""
        self._bus.bound[f"{self._name}_{port}"](message)

    @property
    def is_again(self) -> bool:
        """Return whether the controller was already started since the robot came up."""
        return self._bus.context.is_again

    def keep(self, memory: object) -> None:
        """Have `recall` called with this frozen dataclass, as data, when the controller starts again."""
        self._bus.keep(self._name, memory)

    def warn(self, text: str) -> None:
        """Log something that a person should look at."""
        self._bus.warn(f"controller '{self._name}': {text}")


class Controller(ABC, Generic[C]):
    """Leads joints. It is made when its bus is configured; ports have names of their own, without that of the bus.

    `interface` is what it gives its joints: positions or velocities. While it is inactive, it is not called.
    """

    type_name: ClassVar[str] = ""
    interface: ClassVar[Literal["position", "velocity"]] = "position"
    kinds: ClassVar[frozenset[str]] = frozenset()
    """Kinds of joints that it can lead, in the words of URDF; empty if of any kind."""
    topics: ClassVar[Mapping[str, str]] = MappingProxyType({})
    """The fields that give ports their topics: port -> field."""

    def __init__(self, name: str, config: C, site: ControllerSite) -> None:
        self.name, self.config, self.site = name, config, site
        self.prepare()

    @classmethod
    def config_type(cls) -> type[ControllerConfig]:
        """Return the configuration model, as named by `Controller[...]`."""
        for generic in (one for base in inspect.getmro(cls) for one in getattr(base, "__orig_bases__", ())):
            for argument in get_args(generic):
                if isinstance(argument, type) and issubclass(argument, ControllerConfig):
                    return argument
        raise TypeError(f"{cls.__qualname__} does not name its configuration: Controller[...]")

    @classmethod
    def kinds_for(cls, config: C) -> frozenset[str]:
        """Return the kinds of joints that it can lead with a configuration, as `kinds` does for any."""
        return cls.kinds

    @classmethod
    def ports(cls, name: str, config: C) -> dict[str, Port[Any]]:
        """Return its ports."""
        return {}

    @classmethod
    def capabilities(cls, name: str, config: C) -> tuple[Capability, ...]:
        """Return what checks and commands should know about it, with its own names of ports and fields."""
        return ()

    @classmethod
    def mistake(cls, config: C) -> tuple[str, str] | None:
        """Return the field and the reason, if a configuration cannot work although each of its values can."""
        return None

    @classmethod
    def asks(cls, config: C) -> Mapping[str, tuple[float, float]]:
        """Return the least and the greatest position that it may give its joints, as far as the configuration says."""
        return {}

    def prepare(self) -> None:
        """Set up what it needs."""

    def start(self) -> None:
        """Begin: the robot is up, or has been before this started again."""

    def recall(self, memory: Any) -> None:
        """Take what it has given its site to keep, as data: it has started again."""

    def accept(self, port: str, goal: Any) -> str:
        """Return why a goal at a port is refused; nothing accepts it."""
        return ""

    def received(self, port: str, message: Any) -> None:
        """Take a message of an input."""

    def asked(self, port: str, request: Any) -> Any:
        """Return the response to a request."""
        raise NotImplementedError(port)

    @abstractmethod
    def cycle(self, now: float, dt: float) -> None:
        """Lead its joints up to `now + dt` [s]; called in each cycle, after all joints were measured."""

    def publish(self) -> None:
        """Publish what it knows, some 50 times per second."""

    def halt(self, now: float, reason: str) -> None:
        """End what it does; its joints come to rest within their limits."""

    def let_go(self, joint: str, now: float, reason: str) -> None:
        """Leave a joint alone, which has lost its torque; the others come to rest."""
        self.halt(now, reason)

    def set_pace(self, share: float) -> str:
        """Move at a share from 0 to 1 of the speed that goals ask for, also at once; return why it cannot."""
        return f"a controller of the type '{self.type_name}' has no speed to change while it moves"

    @property
    def leads(self) -> bool:
        """Return whether it moves its joints now, so that they take no single commands."""
        return False

    @property
    def note(self) -> str:
        """Return what people should know of it now; empty if there is nothing to say."""
        return ""


def controller(name: str) -> Callable[[T], T]:
    """Register a controller class under the name of its type.

    Raises:
        ValueError: if another class has this name.
    """

    def register(cls: T) -> T:
        other = _TYPES.get(name)
        if other is not None and (other.__module__, other.__qualname__) != (cls.__module__, cls.__qualname__):
            raise ValueError(f"two controllers are named '{name}': {other.__module__} and {cls.__module__}")
        cls.type_name = name
        _TYPES[name] = cls
        return cls

    return register


def controller_names() -> list[str]:
    """Return the names of all types, sorted, without importing any."""
    return sorted({*PLUGINS.names(), *_TYPES})


def controller_type(name: str) -> type[Controller[Any]]:
    """Return the class of a type, importing its file if necessary.

    Raises:
        KeyError: if no type has this name.
        BrokenPluginError: if it belongs to another package and cannot be used.
    """
    return PLUGINS.find(name, _TYPES, f"class by @controller({name!r})")
