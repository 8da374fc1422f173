"""The contract of a component: configuration, ports, lifecycle, one step at a time."""

import inspect
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from functools import cache
from typing import Any, ClassVar, Generic, Protocol, Self, TypeVar, get_args

from rbxcompose.base.clock import NANOSECONDS, Clock
from rbxcompose.base.config import Config
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Command, Query, Refused, Request, Requests, answering, requests
from rbxcompose.msgs.builtin_interfaces import Time
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.sdk.bound import Window
from rbxcompose.sdk.capabilities import Capability
from rbxcompose.sdk.ports import In, Port
from rbxcompose.sdk.updater import DiagnosticTask

RECALLED_WITHIN = 0.2  # [s] after the start of a component, in which requests that it has `repeat`ed come again


@dataclass(frozen=True, slots=True)
class MissionOver:
    """A mission has ended with `outcome`; when the one that `up` started ends, the robot may go down."""

    mission: str
    outcome: str
    message: str = ""


@dataclass(frozen=True, slots=True)
class MissionWaits:
    """A mission cannot begin because a value has not arrived; `message` names it."""

    mission: str
    message: str


@dataclass(frozen=True, slots=True)
class RobotHeld:
    """A component needs the robot to stand still, for a `reason`: it is stopped, and not released until that is over.

    An empty reason tells that it is over; the robot still stays stopped until somebody releases it.
    """

    component: str
    reason: str


@dataclass(frozen=True, slots=True)
class ComponentNoted:
    """What people should see of a component in `ps`; an empty text ends it."""

    component: str
    text: str


RobotEvent = MissionOver | MissionWaits | RobotHeld | ComponentNoted


A = TypeVar("A")
C = TypeVar("C", bound=Config)


@dataclass(frozen=True, slots=True)
class BusAddress:
    """Where a robot is on the bus, for what joins it from within: its router, ROS domain and namespace.

    There is no router where robot time is stepped: nothing outside keeps up with that.
    """

    robot: str
    router: str
    domain: int
    namespace: str
    wire: str
    """The distribution of ROS 2 whose format is on the wire."""


class Context(Protocol):
    """What the runtime provides to a component besides its ports."""

    clock: Clock

    @property
    def is_stopped(self) -> bool:
        """Return whether the robot is held by a stop."""

    @property
    def starts_mission(self) -> bool:
        """Return whether the mission of `start` is to start: not when it is over, nor because files have changed."""

    @property
    def is_again(self) -> bool:
        """Return whether it was already started since the robot came up: it, or its process, has failed since."""

    @property
    def is_over(self) -> bool:
        """Return whether nobody waits any more for the call that runs: one that may block should return soon."""

    @property
    def address(self) -> BusAddress:
        """Return where the robot is on the bus."""

    def log(self, level: Level, text: str) -> None:
        """Write one event of the robot's story."""

    def status(self, level: Level, message: str, values: Mapping[str, object]) -> None:
        """Report the component's state to diagnostics."""

    def watch(self, name: str, task: DiagnosticTask) -> None:
        """Report how `task` stands to diagnostics, once a second while the component is active."""

    def wake_at(self, time: float) -> None:
        """Call the component's `wake` at robot time `time` [s]; earlier requests remain."""

    def notify(self, event: RobotEvent) -> None:
        """Report something that concerns the whole robot to the supervisor."""

    def repeat(self, requests: Sequence[Command]) -> None:
        """Send these, instead of earlier ones, to the component again, at most `RECALLED_WITHIN` after its restart."""

    def window(self, path: str, question: Query[Any]) -> Window:
        """Open a window for tools outside at `path`; queries there get the component's answer to `question`."""

    def listen(self, port: In[Any]) -> None:
        """Subscribe to the topic of an input, named like one of `ports` or anew, instead of what its name had before.

        Its messages go where those of the component's own ports go.

        Raises:
            Refused: if its topic is no name of ROS, or one on which the component itself publishes.
        """

    def mute(self, name: str) -> None:
        """End the subscription of an input; do nothing if there is none."""


class Component(Generic[C]):
    """A running component of the robot: subclass it, declare ports, override what you need.

    The runtime calls one method at a time. Time comes from `now`, never from Python's clocks.

    A `blocking` component is called in its own thread, so that it delays nothing else. During a call its messages wait,
    as many as their quality class allows; commands, and goals of an action with a method `accept_<port>`, are refused.
    `is_at_rest`, `occupation` and `summary` are read at any time, even during a call: they should only read plain
    attributes.
    """

    rate: ClassVar[float] = 0.0  # [Hz] of `step`; 0: no steps
    steps_for_goals: ClassVar[bool] = False  # steps only while an action that it serves has a goal, and once after it
    process: ClassVar[str] = "robot"  # default process group
    blocking: ClassVar[bool] = False  # may wait or compute for a long time: runs in a thread of its own
    configures_within: ClassVar[float] = 30.0  # [s] for a blocking one to be configured, or active; else it has failed
    has_parameters: ClassVar[bool] = True  # its settings are parameters of ROS 2
    simulated: ClassVar[bool] = False  # exists only in simulation
    made_by: ClassVar[str] = ""  # says which section creates it, for a type that users do not list themselves
    type_name: ClassVar[str] = ""  # set by the decorator
    hardware_id: str = ""  # which device it is, such as a serial number, in what it reports to diagnostics

    def __init__(self, name: str, config: C, context: Context) -> None:
        self.name = name
        self.config = config
        self.context = context
        self.bound: dict[str, Any] = {}  # by port name, filled before `configure`
        self.at_end = ExitStack()  # closed after `cleanup`, and instead of it after an exception

    @classmethod
    def config_type(cls) -> type[Config]:
        """Return the configuration model, as named by `Component[...]`."""
        for base in inspect.getmro(cls):
            for generic in getattr(base, "__orig_bases__", ()):
                for argument in get_args(generic):
                    if isinstance(argument, type) and issubclass(argument, Config):
                        return argument
        return Config

    @classmethod
    def rate_of(cls, config: C) -> float:
        """Return how often `step` runs with this configuration [Hz]: `rate`, if that does not say otherwise."""
        return cls.rate

    @classmethod
    def ports(cls, config: C) -> dict[str, Port[Any]]:
        """Return all ports by name; override to add those that depend on the configuration."""
        here: Any = cls  # mypy considers classes of a generic not hashable
        return dict(_declared_ports(here))

    @classmethod
    def capabilities(cls, config: C) -> tuple[Capability, ...]:
        """Return what checks and commands should know about a component with this configuration."""
        return ()

    @property
    def now(self) -> float:
        """Return robot time [s]."""
        return self.context.clock.now()

    @property
    def stamp(self) -> int:
        """Return the time for message headers [ns]."""
        return self.context.clock.stamp()

    def time_of(self, stamp: Time) -> float:
        """Return the robot time of a stamp [s]: that of now for one that is zero, or ahead of now."""
        age = (self.stamp - to_nanoseconds(stamp)) / NANOSECONDS if stamp != Time() else 0.0
        return self.now - max(0.0, age)

    @property
    def is_at_rest(self) -> bool:
        """Return whether everything that this component moves is at rest."""
        return True

    @classmethod
    def rest_time(cls, config: C) -> float:
        """Return how long it may take to come to rest when the robot goes down [s]; then it ends as it is."""
        return 1.0

    @property
    def occupation(self) -> str:
        """Return the work that a restart would cut off, such as `mission patrol runs`; empty if none."""
        return ""

    @property
    def claims(self) -> bool:
        """Return whether its occupation claims parts that move the robot."""
        return False

    def info(self, text: str) -> None:
        """Log an event."""
        self.context.log(Level.OK, text)

    def warn(self, text: str) -> None:
        """Log a warning that a person should look at."""
        self.context.log(Level.WARN, text)

    def status(self, level: Level, message: str, /, **values: object) -> None:
        """Report this component's state to diagnostics."""
        self.context.status(level, message, values)

    def add_diagnostic(self, name: str, task: DiagnosticTask) -> None:
        """Report `task` as `component: name` to diagnostics, once a second while the component is active.

        `configure` adds what it wants to be reported: a `FrequencyTask(least=10.0).status`, or a function of the time.
        """
        self.context.watch(name, task)

    def configure(self) -> None:
        """Prepare: import heavy packages, build the core, open devices. Nothing moves yet.

        Give what must be released in any case, such as an open port, to `at_end`: a context, or a callback. It is
        called even after an exception of this component, which is then called for nothing else.
        """

    def reconfigure(self, old: C) -> None:
        """Apply `config`, which differs from `old` in fields that are marked `Live` or `Replaceable`.

        Raises:
            Refused: if this cannot be done now, with the reason; `config` is then `old` again.
        """

    def consider(self, new: C) -> Iterable[str]:
        """Say what `new` would do to the work that is under way; called before it is applied, or replaces this one.

        Raises:
            Refused: if that work could not go on, with the reason; nothing is changed then.
        """
        return ()

    def take_over(self, old: Self) -> None:
        """Replace `old`, which had other settings and has been retired; called after `configure`."""

    def activate(self) -> None:
        """Start working; steps and messages come from now on."""

    def deactivate(self) -> None:
        """Stop working; steps and messages end."""

    def cleanup(self) -> None:
        """Release what `configure` acquired; not called after an exception, unlike what `at_end` was given."""

    def step(self, dt: float) -> None:
        """Advance by `dt` [s], `rate` times per second."""

    def received(self, port: str, message: Any) -> None:
        """Handle a message of an input that has no method `on_<port>` of its own."""

    def wake(self) -> None:
        """Do the work for which `context.wake_at` was called."""

    def start(self) -> None:
        """Start everything that waits for the whole robot to be active."""

    def stop(self) -> None:
        """Hold everything that moves until `release`: someone pressed stop."""

    def release(self) -> None:
        """Allow motion again, without starting any."""

    def hold(self) -> None:
        """Command only a stop until `go_on`: robot time and all deadlines stand still."""

    def go_on(self) -> None:
        """Resume commands: robot time runs again. Earlier commands no longer count."""

    def brake(self) -> None:
        """Stop for good: the robot is going down."""

    def lost(self, names: tuple[str, ...], cause: str) -> None:
        """Handle the loss of these components."""

    @classmethod
    def requests(cls) -> Requests:
        """Return the requests that it takes: those whose methods are marked with `answers`."""
        return requests(*answering(cls))

    def handle(self, request: Request[A]) -> A:
        """Return the answer to a request of a person or a tool.

        Raises:
            Refused: if the request cannot be carried out, with the reason.
        """
        method = answering(type(self)).get(type(request))
        if method is None:
            raise Refused(f"'{self.name}' does not take the request '{request.name()}'")
        answer: A = getattr(self, method)(request)
        return answer

    def summary(self) -> dict[str, str]:
        """Return facts for the summary at the end, by label."""
        return {}


@cache
def _declared_ports(cls: Any) -> Mapping[str, Port[Any]]:
    return {name: port for name, port in inspect.getmembers(cls) if isinstance(port, Port)}
