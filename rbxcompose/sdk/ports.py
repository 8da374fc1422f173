"""Ports: what a component publishes and subscribes to, declared in its class so that `check` knows them."""

import re
from collections.abc import Collection, Mapping
from enum import StrEnum
from functools import partial
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Generic, NamedTuple, Protocol, Self, TypeVar, overload

from pydantic import AfterValidator
from pydantic_core import PydanticCustomError

from rbxcompose.base.findings import nearest
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import FieldShape
from rbxcompose.msgs.fields import ArrayEntries, Measures, NoFieldError, NumberRange, field_type
from rbxcompose.msgs.types import Action, Message, Service
from rbxcompose.sdk.bound import ActionCaller, ActionServer, Caller, Latest, Look, Sender

_FIND = {"msg": registry.message, "srv": registry.service, "action": registry.action}
_WHAT = {"msg": "message", "srv": "service", "action": "action"}


def _known(kind: str, name: str) -> str:
    try:
        return _FIND[kind](name).TYPE
    except KeyError:
        known, what = tuple(registry.names(kind)), _WHAT[kind]
        short = re.split(r"[/.:]+", name)[-1]  # the names in that of a type: `.` in Python, `::` in C++
        near = nearest(short, {text.rpartition("/")[-1]: text for text in known})
        alike = tuple(text for text in known if near and text.rpartition("/")[-1] == near[0])
        if alike and short == name:
            full = " or ".join(f"'{item}'" for item in alike)
            details = {"name": name, "kind": what, "help": f"write it with its package: {full}"}
            raise PydanticCustomError("message", "there is no {kind} type '{name}'", details) from None
        context = {"name": name, "kind": what, "valid": alike or known, "what": f"{what} types"}
        raise PydanticCustomError("message", "there is no {kind} type '{name}'", context) from None


MessageName = Annotated[str, AfterValidator(partial(_known, "msg"))]
"""The ROS name of a message type: `std_msgs/Float32`; read as its full name, `std_msgs/msg/Float32`."""
ServiceName = Annotated[str, AfterValidator(partial(_known, "srv"))]
"""The ROS name of a service type: `std_srvs/SetBool`; read as its full name."""
ActionName = Annotated[str, AfterValidator(partial(_known, "action"))]
"""The ROS name of an action type: `nav2_msgs/NavigateToPose`; read as its full name."""


def number_field(message: str, path: str) -> str:
    """Return `path` if it names a number in messages of type `message`.

    Raises:
        PydanticCustomError: if it does not; for use in validators of configurations.
    """
    try:
        found = field_type(message, path)
    except NoFieldError as error:
        context = {"name": error.name, "valid": tuple(error.fields), "what": f"'message' is {message}, with the fields"}
        raise PydanticCustomError("field", f"{error.message} has no field '{{name}}'", context) from None
    if found.is_message or found.shape is not FieldShape.SINGLE or found.base in ("string", "bool"):
        raise PydanticCustomError("field", "'{path}' is a {type}, not a number", {"path": path, "type": str(found)})
    return path


class Qos(StrEnum):
    """The purpose of a topic; the bus derives queue depth, reliability, priority and congestion control from it."""

    COMMAND = "command"  # newest wins, dropped rather than late
    STATE = "state"  # newest wins, a few kept
    LATCHED = "latched"  # the last one is kept for late subscribers
    EVENT = "event"  # none may be lost
    BULK = "bulk"  # large, lowest priority

    @property
    def depth(self) -> int:
        """Return how many messages a subscriber queues before it drops the oldest."""
        return _DEPTH[self]


_DEPTH = {Qos.COMMAND: 1, Qos.STATE: 10, Qos.LATCHED: 1, Qos.EVENT: 10_000, Qos.BULK: 2}


class MessageLimits(NamedTuple):
    """What a port takes of another process at most; a message beyond that is refused before it is decoded."""

    size: int = 256 * 1024
    """Bytes."""
    entries: int = 2_000
    """Entries of all its lists of texts and messages; each takes some 10 µs to decode."""


ORDINARY = MessageLimits()
BULK = MessageLimits(64 * 1024 * 1024, 10_000)
"""For topics of QoS class `bulk`, such as images and clouds, and for who only looks at any topic."""


def limits_of(qos: Qos) -> MessageLimits:
    """Return the limits that messages of a QoS class have if none are declared."""
    return BULK if qos is Qos.BULK else ORDINARY


M = TypeVar("M", bound=Message)
Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)
G = TypeVar("G", bound=Message)
F = TypeVar("F", bound=Message)
B = TypeVar("B")  # what the port is on a component


class HasPorts(Protocol):
    """A component as its ports see it."""

    bound: dict[str, Any]  # the live object of each port, by name


LONGEST_NAME = 247  # rmw's limit: 255 bytes less the prefixes that some middleware adds
_NAME = re.compile(r"/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)


def name_problem(name: str) -> str:
    """Return what is wrong with `name` as a ROS name, or nothing if it is fine."""
    if not name:
        return "a name cannot be empty"
    if len(name) > LONGEST_NAME:
        return f"a name has at most {LONGEST_NAME} characters, this one {len(name)}"
    if not _NAME.fullmatch(name):
        return f"'{name}' is not a ROS name: words of letters, digits and '_', not starting with a digit, joined by '/'"
    return ""


class Port(Generic[B]):
    """A named end of a wire. `topic` is its ROS name, relative to the robot's namespace unless it starts with `/`."""

    kind: ClassVar[str]
    interface: type[Any] | None = None  # message, service or action
    is_elsewhere = False  # a program of others has the end of the wire; nothing is bound here

    def __init__(self, topic: str) -> None:
        self.topic = topic
        self.name = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, component: None, owner: type) -> Self: ...
    @overload
    def __get__(self, component: HasPorts, owner: type) -> B: ...
    def __get__(self, component: HasPorts | None, owner: type) -> Self | B:
        return self if component is None else self.of(component)

    def of(self, component: HasPorts) -> B:
        """Return the live object of this port on `component` (for ports that depend on its configuration)."""
        bound: B = component.bound[self.name]
        return bound

    def named(self, name: str) -> Self:
        """Set the name of a port that is not an attribute of a class."""
        self.name = name
        return self

    def elsewhere(self) -> Self:
        """Declare that a program of others, which the component runs, has this end of the wire."""
        self.is_elsewhere = True
        return self


class Out(Port[Sender[M]]):
    """Publishes messages: call it with one. `unit` says what a bare number in the message means (`%`).

    With a `rate` [Hz], diagnostics tell whether it publishes at least that often, and whether the stamps of its
    messages are of now.
    """

    kind = "out"

    def __init__(
        self, message: type[M], topic: str, *, qos: Qos | str = Qos.STATE, unit: str = "", rate: float | None = None
    ) -> None:
        super().__init__(topic)
        self.interface, self.qos, self.unit, self.rate = message, Qos(qos), unit, rate


class In(Port[Latest[M]]):
    """Subscribes to messages: each one goes to the method `on_<port>`; the newest can be read.

    The method raises `Refused` for a message that cannot be used: diagnostics count it, and the component runs on.
    """

    kind = "in"

    def __init__(
        self,
        message: type[M],
        topic: str,
        *,
        qos: Qos | str = Qos.STATE,
        unit: str = "",
        is_open: bool = False,
        max_rate: float | None = None,
        limits: MessageLimits | None = None,
        may_be_silent: bool = False,
        remedy: str = "",
    ) -> None:
        """Take `is_open` for an input that may also be fed from outside the robot.

        `may_be_silent` is for one whose publishers speak only now and then: nobody misses them. The `remedy` tells
        people what to do without a publisher, if no other topic of the same type can stand in.

        At most `max_rate` messages per second are taken from each publisher of another process [Hz]; commands are
        always limited. Their messages beyond the `limits` are refused before they are decoded; by default, these are
        those of the QoS class. A handler must be done with the longest message in much less than 0.5 s.
        """
        super().__init__(topic)
        self.interface, self.qos, self.unit, self.is_open, self.max_rate = message, Qos(qos), unit, is_open, max_rate
        self.limits = limits or limits_of(self.qos)
        self.may_be_silent, self.remedy = may_be_silent, remedy


class ServesTopic(In[M]):
    """Takes orders, each one a message; it is a skill of every mission under its topic's name.

    The method `on_<port>` begins to carry out an order, and a newer one replaces it. The fields of the message are the
    arguments of the skill; `claims`, `restartable`, `outcomes` and `entries` are as in `ServesAction`.

    `ends` is the output of the same component that reports how an order ended: by its flag `success`, perhaps an
    `outcome`, and a `message` with the reason. Without it the skill succeeds as soon as the order is sent. `halts` is
    the input that receives an empty message when an order is aborted: by a pause, a stop, a deadline, an interrupt or
    the end of the mission. Without it no order can be taken back. No order can be held: one aborted by a pause is sent
    again at the resume.

    Orders have no numbers. So of all orders whose ends are reported at one output, at most one is active: a newer one
    of a mission aborts the older one, which then fails. An order that was aborted, or ended by a stop of the robot,
    should report no end. A report within 0.2 s is known to be late; a later one would end the next order. Orders that
    somebody else sends meanwhile cannot be distinguished, either.
    """

    kind = "serves_topic"

    def __init__(
        self,
        message: type[M],
        topic: str,
        *,
        ends: Out[Any] | None = None,
        halts: In[Any] | None = None,
        claims: str = "",
        restartable: bool = True,
        outcomes: Mapping[str, str] = MappingProxyType({}),
        entries: ArrayEntries | None = None,
        qos: Qos | str = Qos.EVENT,
        max_rate: float | None = None,
        limits: MessageLimits | None = None,
    ) -> None:
        """Declare the port.

        Raises:
            ValueError: if `ends` cannot report an end, if `halts` or `outcomes` could never be used, or if the message
                does not have the `entries`.
        """
        super().__init__(message, topic, qos=qos, is_open=True, max_rate=max_rate, limits=limits)
        end: type[Message] | None = ends.interface if ends is not None else None
        if end is not None and end.FIELDS.get("success") != "bool":
            raise ValueError(f"{end.TYPE} has no flag 'success' to report the end of an order")
        if halts is not None and end is None:
            raise ValueError("an order without 'ends' is over once it is sent: 'halts' would never be used")
        if outcomes and end is None:
            raise ValueError("an order without 'ends' is over once it is sent: nothing can report an outcome")
        _require_outcomes(outcomes, end)
        if halts is not None:
            halts.is_open = True  # whether a mission feeds it depends on the skills that the robot's missions use
        if entries is not None:
            entries.require_in(message)
        self.ends, self.halts, self.entries = ends, halts, entries
        self.claims, self.restartable, self.outcomes = claims, restartable, outcomes


class SendsOrders(Out[M]):
    """Sends orders to the components `servers`, and knows whether they listen. Missions use it for their skills."""

    def __init__(self, message: type[M], topic: str, *, servers: Collection[str], qos: Qos | str = Qos.EVENT) -> None:
        super().__init__(message, topic, qos=qos)
        self.servers = servers


class Serves(Port[None]):
    """Serves requests: the method `on_<port>` takes a request and returns the response, or a `Later` that brings it.

    It is a skill of missions if the response has a flag `success`; `skill` is as in `ServesAction`. `unit` says what a
    bare number in the request means (`%`). `limits` are as in `In`.
    """

    kind = "serves"

    def __init__(
        self,
        service: type[Service[Q, R]],
        topic: str,
        *,
        skill: str | None = "",
        unit: str = "",
        limits: MessageLimits = ORDINARY,
    ) -> None:
        super().__init__(topic)
        self.interface, self.skill, self.unit = service, skill, unit
        self.limits = limits


class Calls(Port[Caller[Q, R]]):
    """Calls a service of another component."""

    kind = "calls"

    def __init__(self, service: type[Service[Q, R]], topic: str) -> None:
        super().__init__(topic)
        self.interface = service


class ServesAction(Port[ActionServer[G, R, F]]):
    """Carries out one goal at a time; a newer one replaces it. It is a skill of every mission under its topic's name.

    `claims` names the parts of the robot that a goal needs exclusively (`base`, `arm`, `head`, `voice`). `outcomes` are
    ends besides success and failure, each with which of the two it counts as; the result names them in its text field
    `outcome`. A `pausable` one respects `current.is_paused`: the service `<topic>/pause` holds goals. The optional
    method `accept_<port>` may refuse a goal by returning the reason. `skill` is its name in missions; without it, that
    is the last word of the topic, and None means that missions do not have it. Its arguments are the fields of the
    goal, and the `entries` of two of its arrays. `measures` are the dimensions of numbers of the goal, so that missions
    write them with units: `{"opening": LENGTH}`; a map stands for those of a nested message, which becomes an argument
    by it. `ranges` are what missions may write for numbers: `{"speed": NumberRange(0.0, 1.0, is_open=True)}` refuses 0,
    though a goal with a field of 0 means that none is given. `choices` are the words that texts of the goal may be; the
    first of these texts is the main argument if there are `entries`, else that is the first argument. It must be given
    if it measures something, unless it `may_lack`.
    """

    kind = "serves_action"

    def __init__(
        self,
        action: type[Action[G, R, F]],
        topic: str,
        *,
        claims: str = "",
        restartable: bool = True,
        pausable: bool = False,
        outcomes: Mapping[str, str] = MappingProxyType({}),
        skill: str | None = "",
        entries: ArrayEntries | None = None,
        measures: Measures = MappingProxyType({}),
        choices: Mapping[str, Collection[str]] = MappingProxyType({}),
        ranges: Mapping[str, NumberRange] = MappingProxyType({}),
        may_lack: bool = False,
        limits: MessageLimits = ORDINARY,
    ) -> None:
        """Declare the port.

        Raises:
            ValueError: if there are outcomes but the result has no field for them, one counts as something else, or the
                goal does not have the `entries`, a number that `measures` names, or a text that `choices` names.
        """
        super().__init__(topic)
        self.skill = skill
        _require_outcomes(outcomes, action.Result)
        if entries is not None:
            entries.require_in(action.Goal)
        self.entries = entries
        if wrong := [
            name for name, measure in measures.items() if not _is_measured(action.Goal.FIELDS.get(name, ""), measure)
        ]:
            raise ValueError(f"{action.Goal.TYPE} has no number '{wrong[0]}'")
        if wrong := [name for name in choices if action.Goal.FIELDS.get(name) != "string"]:
            raise ValueError(f"{action.Goal.TYPE} has no text '{wrong[0]}'")
        self.measures, self.choices, self.ranges, self.may_lack = measures, choices, ranges, may_lack
        self.interface, self.claims, self.restartable = action, claims, restartable
        self.pausable, self.outcomes, self.limits = pausable, outcomes, limits


class CallsAction(Port[ActionCaller[G, R, F]]):
    """Sends goals to another component."""

    kind = "calls_action"

    def __init__(self, action: type[Action[G, R, F]], topic: str) -> None:
        super().__init__(topic)
        self.interface = action


def _is_measured(ros: str, measure: object) -> bool:
    return "/" in ros if isinstance(measure, Mapping) else ros in ("float32", "float64")


def _require_outcomes(outcomes: Mapping[str, str], end: type[Message] | None) -> None:
    if outcomes and end is not None and end.FIELDS.get("outcome") != "string":
        raise ValueError(f"{end.TYPE} has no text field 'outcome'")
    if wrong := set(outcomes.values()) - {"success", "failure"}:
        raise ValueError(f"an outcome counts as success or failure, not as {', '.join(sorted(wrong))}")


class Looks(Port[Look]):
    """Looks up the pose of frame `source` in frame `target`, newest or at a time."""

    kind = "looks"

    def __init__(self, *, source: str, target: str) -> None:
        super().__init__("")
        self.source, self.target = source, target
