"""Which topic takes the velocities of a person who drives: an input of a mux, never what lies behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rbxcompose.bus.graph import GraphName
from rbxcompose.cli.bus.entities import NO_NAME
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.msgs.geometry_msgs import Twist

_USUAL = "/cmd_vel/teleop"  # where several inputs are free, and nothing is known of their priorities
_OPEN_ONE = "give the mux an input without 'from', such as 'teleop: {priority: 100, timeout: 0.5 s}'"


def command_topic(topics: Sequence[GraphName], wanted: str | None, inputs: Mapping[str, str] | None) -> str:
    """Return the topic on which to publish velocities: the `wanted` one, or the only one that is right.

    `inputs` has the open input of each base of the robot; None if only its bus is known. Then what counts is what
    nobody publishes on, and what lies behind no node that forwards velocities.

    Raises:
        NotDoneError: if nothing takes velocities there, or if there are several.
    """
    taking = [one for one in topics if one.takers and Twist.TYPE in one.types]
    names = [one.name for one in taking if not _is_forwarded(one, taking)]
    if wanted is not None:
        full = f"/{wanted.lstrip('/')}"
        if any(one.name == full for one in taking):
            return full
        words = f"nothing takes velocities on '{full}'"
        raise NotDoneError(NO_NAME.misspelt(None, words, full, names, "topics that take velocities"))
    if inputs is not None:
        return _only(sorted(set(inputs.values())), inputs)
    free = [one.name for one in taking if one.name in names and not one.givers]
    usual = [name for name in free if name.endswith(_USUAL)]
    return _only(usual if len(usual) == 1 else free, {})


def _only(names: Sequence[str], inputs: Mapping[str, str]) -> str:
    if len(names) == 1:
        return names[0]
    if not names:
        raise NotDoneError(NO_NAME.at(None, "no topic is free for the velocities of a person", help=_OPEN_ONE))
    bases = {topic: base for base, topic in inputs.items()}
    told = ", ".join(f"{name} ('{bases[name]}')" if name in bases else name for name in names)
    raise NotDoneError(NO_NAME.at(None, f"several topics take velocities: {told}", help="choose one with '--topic'"))


def _is_forwarded(topic: GraphName, taking: Sequence[GraphName]) -> bool:
    """Return whether one who publishes here takes velocities elsewhere, as a mux does."""
    givers = {end.node for end in topic.givers}
    return any(end.node in givers for other in taking if other is not topic for end in other.takers)
