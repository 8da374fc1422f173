"""Actions as ROS 1 has them, for pages that were written for it: five topics beside the name of the action.

They exist for clients of the gateway only. `/move_base` stands for the one action that navigates, if no other has that
name; fields that were renamed since are understood by their old names, too.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from rbxcompose.missions.execution.errands import text_in
from rbxcompose.sdk.bound import Ended, Outcome

_TOPIC = re.compile(r"(?P<action>/.+)/(?P<part>goal|cancel|status|feedback|result)")
_STANDS_FOR = {"/move_base": "nav2_msgs/action/NavigateToPose"}
_NEW_NAMES = {"target_pose": "pose"}  # of fields of goals
_OLD_NAMES = {"current_pose": "base_position"}  # of fields of feedback
ACTIVE = 1
STATES = {Outcome.SUCCEEDED: 3, Outcome.CANCELED: 2, Outcome.ABORTED: 4, Outcome.REJECTED: 5, Outcome.LOST: 9}
"""Numbers of `actionlib_msgs/GoalStatus`, as is `ACTIVE`."""
MOST_STATUSES = 20


def action_of(name: str, actions: Mapping[str, str]) -> str:
    """Return the action that a name means: its own, or what it stands for; empty if there is none."""
    if name in actions:
        return name
    found = [action for action, type_ in actions.items() if type_ == _STANDS_FOR.get(name)]
    return found[0] if len(found) == 1 else ""


def parts_of(topic: str, actions: Mapping[str, str]) -> tuple[str, str, str] | None:
    """Return the name by which a topic calls an action, the action, and which of its topics it is; None if none."""
    found = _TOPIC.fullmatch(topic)
    if found is None or not (action := action_of(found["action"], actions)):
        return None
    return found["action"], action, found["part"]


def goal_of(message: Mapping[str, Any], fields: Mapping[str, str]) -> tuple[object, object]:
    """Return the id and the goal of `XxxActionGoal`, for a goal with these fields."""
    goal, identity = message.get("goal", {}), message.get("goal_id", {})
    if isinstance(goal, Mapping):
        renamed = ((_NEW_NAMES.get(name, name) if name not in fields else name, goal[name]) for name in goal)
        goal = dict(renamed)
    return (identity.get("id", "") if isinstance(identity, Mapping) else ""), goal


def feedback_of(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return feedback with its fields by their old names, too."""
    return {**values, **{old: values[new] for new, old in _OLD_NAMES.items() if new in values}}


def end_of(end: Ended[Any], values: Mapping[str, Any], *, is_replaced: bool) -> tuple[int, str]:
    """Return the state in which a goal ended, and why.

    ROS 2 aborts a goal that another one replaces, ROS 1 preempts it.

    Args:
        end: how it ended on the bus.
        values: the fields of its result.
        is_replaced: whether a newer goal is open.
    """
    text = end.message or text_in(values)
    if end.outcome is Outcome.ABORTED and is_replaced:
        return STATES[Outcome.CANCELED], text or "replaced by a newer goal"
    return STATES[end.outcome], text


def status_of(identity: object, state: int, stamp: Mapping[str, Any], text: str = "") -> dict[str, Any]:
    """Return `actionlib_msgs/GoalStatus`."""
    return {"goal_id": {"stamp": stamp, "id": identity}, "status": state, "text": text}
