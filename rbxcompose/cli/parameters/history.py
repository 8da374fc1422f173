"""Who changed which parameters: `param history` and `watch`."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from datetime import datetime

from rbxcompose.bus.graph import find
from rbxcompose.cli.bus.guest import HeardMessage
from rbxcompose.cli.bus.messages import to_json
from rbxcompose.cli.output.console import table, tell
from rbxcompose.cli.parameters.nodes import ParameterNodes, described
from rbxcompose.msgs.cdr import CdrError, decode
from rbxcompose.msgs.rbxcompose_parameters import ChangeParameters, ParameterChange
from rbxcompose.msgs.rcl_interfaces import (
    ParameterEvent,
)
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.params.core import shown, told_dimension
from rbxcompose.params.history import MARK, ROS_TOOL, identity, in_order
from rbxcompose.params.values import from_message
from rbxcompose.units import Dimension

CHANGE = "change_parameters"
_EVENTS = "/parameter_events"
_HEAD = ("change", "time", "parameter", "before", "after", "by")
_SECOND = 1e9  # [ns]
Dimensions = dict[tuple[str, str], Dimension | None]


def changes_of(nodes: ParameterNodes, wanted: Sequence[str] | None = None) -> list[ParameterChange]:
    """Return the changes of nodes, or of all that keep some."""
    asked = [one for one in (nodes.names if wanted is None else wanted) if nodes.serves(one, CHANGE)]
    requests = [ChangeParameters.Request(tell_changes=True)] * len(asked)
    answers = nodes.ask(asked, CHANGE, ChangeParameters, requests)
    return [one for answer in answers for one in answer.changes]


def param_history(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """List the changes, oldest first."""
    wanted = [nodes.find(arguments.component)] if arguments.component else nodes.names
    by_node = {node: changes_of(nodes, [node]) for node in wanted}
    found = in_order(one for each in by_node.values() for one in each)[-arguments.last :]
    if arguments.json:
        tell(to_json([_data(one) for one in found]))
        return 0
    dimensions = {key: told for node, each in by_node.items() for key, told in _dimensions(nodes, node, each).items()}
    tell(table([_HEAD, *(_row(one, dimensions) for one in found)]) if found else "nothing was changed")
    return 0


def param_watch(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Tell each change when it happens, until an interrupt or until there were enough."""
    wanted = nodes.find(arguments.component) if arguments.component else ""
    asked = [wanted] if wanted else nodes.names
    seen = {node: _last_number(changes_of(nodes, [node])) for node in asked}
    events: list[ParameterEvent] = []

    def heard(message: HeardMessage) -> None:
        try:
            event = decode(ParameterEvent, message.arrival.payload)
        except CdrError:
            return  # another definition of the type
        if not wanted or event.node == wanted:
            events.append(event)

    guest, told = nodes.guest, 0
    topic = find(guest.graph().topics, _EVENTS)
    if topic is None:
        return 0
    guest.listen(topic, heard)
    while arguments.count is None or told < arguments.count:
        guest.run(lambda: bool(events))
        event = events.pop(0)
        new = _of_event(nodes, event, seen)
        dimensions = _dimensions(nodes, event.node, new)
        for one in new[: None if arguments.count is None else arguments.count - told]:
            told += 1
            tell(to_json(_data(one)) if arguments.json else _line(one, dimensions))
    return 0


def _of_event(nodes: ParameterNodes, event: ParameterEvent, seen: dict[str, int]) -> list[ParameterChange]:
    """Return the changes that an event reports; a foreign node does not tell who did it, nor what was before."""
    if not nodes.serves(event.node, CHANGE):
        name = event.node.removeprefix("/")
        each = (*event.new_parameters, *event.changed_parameters)
        return [
            ParameterChange(stamp=event.stamp, component=name, name=one.name, after=one.value, by=ROS_TOOL)
            for one in each
        ]
    found = changes_of(nodes, [event.node])
    since, seen[event.node] = seen.get(event.node, 0), _last_number(found)
    return [one for one in found if one.number > since]


def _last_number(changes: Sequence[ParameterChange]) -> int:
    return changes[-1].number if changes else 0


def _dimensions(nodes: ParameterNodes, node: str, changes: Iterable[ParameterChange]) -> Dimensions:
    names = {one.name: one.component for one in changes}
    found = described(nodes, {node: tuple(names)})
    return {(names[one.about.name], one.about.name): told_dimension(one.about.description) for one in found}


def _row(one: ParameterChange, dimensions: Dimensions) -> tuple[str, ...]:
    dimension = dimensions.get((one.component, one.name))
    texts = (shown(from_message(value), dimension) for value in (one.before, one.after))
    undo = f" (undoes {one.component}{MARK}{one.undoes})" if one.undoes else ""
    return (identity(one), _time(one), f"{one.component}.{one.name}", *texts, one.by + undo)


def _line(one: ParameterChange, dimensions: Dimensions) -> str:
    name, time, parameter, before, after, by = _row(one, dimensions)
    return f"{time}  {parameter}: {before} -> {after}, by {by}" + (f"  [{name}]" if one.number else "")


def _time(one: ParameterChange) -> str:
    return datetime.fromtimestamp(to_nanoseconds(one.stamp) / _SECOND).astimezone().strftime("%H:%M:%S")


def _data(one: ParameterChange) -> dict[str, object]:
    return {
        "change": identity(one),
        "time": to_nanoseconds(one.stamp) / _SECOND,
        "component": one.component,
        "name": one.name,
        "before": from_message(one.before),
        "after": from_message(one.after),
        "by": one.by,
        "together": one.together,
        "undoes": f"{one.component}{MARK}{one.undoes}" if one.undoes else None,
    }
