"""Actions as skills: which arguments a goal has, and the goal that arguments make."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from rbxcompose.expressions.types import COUNT, FLAG, POSE, TEXT, Type, TypeKind, quantity_of
from rbxcompose.expressions.values import Value
from rbxcompose.missions.program import Skill
from rbxcompose.msgs.geometry_msgs import Point, Pose, PoseStamped, Quaternion
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.types import Action, Message
from rbxcompose.units import NUMBER

FRAME = "map"  # that places and poses of missions are in
STAMPED, POSED = "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/Pose"

_TYPES: Mapping[str, Type] = {
    STAMPED: POSE,
    POSED: POSE,
    "string": TEXT,
    "bool": FLAG,
    **dict.fromkeys(("float32", "float64"), quantity_of(NUMBER)),
    **{f"{sign}int{bits}": COUNT for sign in ("", "u") for bits in (8, 16, 32, 64)},
}


def skill_of(action: type[Action[Any, Any, Any]], name: str, claims: str = "", restartable: bool = True) -> Skill:
    """Return the skill that an action is: the fields of its goal are the arguments, the first one is the main one.

    A field of another type than a pose, text, flag or number is no argument and keeps its zero value. Only a pose that
    is the main argument has to be given.
    """
    fields = action.Goal.FIELDS
    arguments = {field: _TYPES[ros] for field, ros in fields.items() if ros in _TYPES}
    main = next(iter(arguments), "")
    needed = [main] if main and arguments[main].kind is TypeKind.POSE else []
    return Skill(name, arguments, main, frozenset(needed), claims, restartable)


def goal_of(action: type[Action[Any, Any, Any]], arguments: Mapping[str, Value]) -> Message:
    """Return the goal with these arguments; places and poses are in `map`.

    Raises:
        KeyError: if the goal has no such field.
        ValueError: if a value does not fit into its field.
    """
    fields = action.Goal.FIELDS
    goal: Message = action.Goal(**{name: _MAKERS[fields[name]](value) for name, value in arguments.items()})
    return goal


def _pose(value: Any) -> Pose:
    half = value.heading / 2
    return Pose(position=Point(x=value.x, y=value.y), orientation=Quaternion(z=math.sin(half), w=math.cos(half)))


def _stamped(value: Any) -> PoseStamped:
    return PoseStamped(header=Header(frame_id=FRAME), pose=_pose(value))


def _whole(value: Any) -> int:
    if value != int(value):
        raise ValueError(f"{value} is no whole number")
    return int(value)


_MAKERS: Mapping[str, Callable[[Any], object]] = {
    STAMPED: _stamped,
    POSED: _pose,
    "string": str,
    "bool": bool,
    **dict.fromkeys(("float32", "float64"), float),
    **{ros: _whole for ros, wanted in _TYPES.items() if wanted == COUNT},
}
