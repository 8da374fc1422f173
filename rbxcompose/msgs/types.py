"""Base classes of all generated classes, and the typing of services and actions.

A function for any service reads `def call(service: type[Service[Q, R]], request: Q) -> R`, and a type checker then
knows that `call(SetBool, SetBool.Request(data=True))` returns a `SetBool.Response`.
"""

from collections.abc import Mapping
from typing import Any, ClassVar, Generic, TypeVar

Fields = Mapping[str, str]  # ROS name of each field -> ROS type, in wire order

declared: dict[str, type[Any]] = {}  # every class that has been imported, by its `TYPE`


class Interface:
    """A ROS 2 interface: `TYPE` is its full name, `HASH` its type hash (RIHS01)."""

    __slots__ = ()
    TYPE: ClassVar[str]
    HASH: ClassVar[str]
    CLASSES: ClassVar[dict[str, type[Any]]] = declared  # where it is, and what it is made of

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "TYPE" in vars(cls):
            cls.CLASSES[cls.TYPE] = cls


class Message(Interface):
    """A message, or one part of a service or an action: a frozen dataclass whose fields all have defaults."""

    __slots__ = ()
    FIELDS: ClassVar[Fields]


RequestT = TypeVar("RequestT", bound=Message)
ResponseT = TypeVar("ResponseT", bound=Message)
GoalT = TypeVar("GoalT", bound=Message)
ResultT = TypeVar("ResultT", bound=Message)
FeedbackT = TypeVar("FeedbackT", bound=Message)


class Service(Interface, Generic[RequestT, ResponseT]):
    """A service: only a name for its two messages, never instantiated."""

    Request: type[RequestT]
    Response: type[ResponseT]


class Action(Interface, Generic[GoalT, ResultT, FeedbackT]):
    """An action: a name for its three messages and what ROS derives from them, never instantiated.

    `SendGoal.Request` has `goal_id` and `goal`, its `Response` `accepted` and `stamp`; `GetResult.Request` has
    `goal_id`, its `Response` `status` (a value of `GoalStatus`) and `result`; `FeedbackMessage` has `goal_id` and
    `feedback`.
    """

    Goal: type[GoalT]
    Result: type[ResultT]
    Feedback: type[FeedbackT]
    SendGoal: type[Service[Any, Any]]
    GetResult: type[Service[Any, Any]]
    FeedbackMessage: type[Any]
