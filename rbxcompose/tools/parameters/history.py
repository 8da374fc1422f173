"""Who changed which parameters: `param history` and `watch`."""

import argparse
from collections.abc import Iterable, Sequence
from datetime import datetime

from rbxcompose.base.units import Dimension
from rbxcompose.bus.graph import find
from rbxcompose.commands.console import emit, table
from rbxcompose.commands.guest import ReceivedMessage
from rbxcompose.commands.messages import to_json
from rbxcompose.msgs.cdr import CdrError, decode
from rbxcompose.msgs.rbxcompose_parameters import ChangeParameters, ParameterChange
from rbxcompose.msgs.rcl_interfaces import ParameterEvent
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.runtime.settings_history import MARK, ROS_TOOL, identity, in_order
from rbxcompose.sdk.parameters import dimension_in, from_message, shown
from rbxcompose.tools.parameters.nodes import ParameterNodes, described

CHANGE = "change_parameters"
_EVENTS = "/parameter_events"
_HEAD = ("change", "time", "parameter", "before", "after", "by")
_SECOND = 1e9  # [ns]
Dimensions = dict[tuple[str, str], Dimension | None]


def changes_of(nodes: ParameterNodes, wanted: Sequence[str] | None = None) -> list[ParameterChange]:
    """Return the changes of nodes, or of all that keep some."""
    asked = [name for name in (nodes.names if wanted is None else wanted) if nodes.serves(name, CHANGE)]
    requests = [ChangeParameters.Request(tell_changes=True)] * len(asked)
    answers = nodes.ask(asked, CHANGE, ChangeParameters, requests)
    return [change for answer in answers for change in answer.changes]


def param_history(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """List the changes, oldest first."""
    wanted = [nodes.find(arguments.component)] if arguments.component else nodes.names
    by_node = {node: changes_of(nodes, [node]) for node in wanted}
    found = in_order(change for each in by_node.values() for change in each)[-arguments.last :]
    if arguments.json:
        emit(to_json([_data(item) for item in found]))
        return 0
    dimensions = {
        key: dimension for node, each in by_node.items() for key, dimension in _dimensions(nodes, node, each).items()
    }
    emit(table([_HEAD, *(_row(item, dimensions) for item in found)]) if found else "nothing was changed")
    return 0


def param_watch(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Tell each change when it happens, until an interrupt or until there were enough."""
    wanted = nodes.find(arguments.component) if arguments.component else ""
    asked = [wanted] if wanted else nodes.names
    seen = {node: _last_number(changes_of(nodes, [node])) for node in asked}
    events: list[ParameterEvent] = []

    def received(message: ReceivedMessage) -> None:
        try:
            event = decode(ParameterEvent, message.arrival.payload)
        except CdrError:
            return  # another definition of the type
        if not wanted or event.node == wanted:
            events.append(event)

    guest, printed = nodes.guest, 0
    topic = find(guest.graph().topics, _EVENTS)
    if topic is None:
        return 0
    guest.listen(topic, received)
    while arguments.count is None or printed < arguments.count:
        guest.run(lambda: bool(events))
        event = events.pop(0)
        new = _of_event(nodes, event, seen)
        dimensions = _dimensions(nodes, event.node, new)
        for change in new[: None if arguments.count is None else arguments.count - printed]:
            printed += 1
            emit(to_json(_data(change)) if arguments.json else _line(change, dimensions))
    return 0


def _of_event(nodes: ParameterNodes, event: ParameterEvent, seen: dict[str, int]) -> list[ParameterChange]:
    """Return the changes that an event reports; a foreign node reports neither who did it nor what was before."""
    if not nodes.serves(event.node, CHANGE):
        name = event.node.removeprefix("/")
        each = (*event.new_parameters, *event.changed_parameters)
        return [
            ParameterChange(stamp=event.stamp, component=name, name=parameter.name, after=parameter.value, by=ROS_TOOL)
            for parameter in each
        ]
    found = changes_of(nodes, [event.node])
    since, seen[event.node] = seen.get(event.node, 0), _last_number(found)
    return [change for change in found if change.number > since]


def _last_number(changes: Sequence[ParameterChange]) -> int:
    return changes[-1].number if changes else 0


def _dimensions(nodes: ParameterNodes, node: str, changes: Iterable[ParameterChange]) -> Dimensions:
    names = {change.name: change.component for change in changes}
    found = described(nodes, {node: tuple(names)})
    return {(names[item.about.name], item.about.name): dimension_in(item.about.description) for item in found}


def _row(change: ParameterChange, dimensions: Dimensions) -> tuple[str, ...]:
    dimension = dimensions.get((change.component, change.name))
    texts = (shown(from_message(value), dimension) for value in (change.before, change.after))
    undo = f" (undoes {change.component}{MARK}{change.undoes})" if change.undoes else ""
    return (identity(change), _time(change), f"{change.component}.{change.name}", *texts, change.by + undo)


def _line(change: ParameterChange, dimensions: Dimensions) -> str:
    name, time, parameter, before, after, by = _row(change, dimensions)
    return f"{time}  {parameter}: {before} -> {after}, by {by}" + (f"  [{name}]" if change.number else "")


def _time(change: ParameterChange) -> str:
    return datetime.fromtimestamp(to_nanoseconds(change.stamp) / _SECOND).astimezone().strftime("%H:%M:%S")


def _data(change: ParameterChange) -> dict[str, object]:
    return {
        "change": identity(change),
        "time": to_nanoseconds(change.stamp) / _SECOND,
        "component": change.component,
        "name": change.name,
        "before": from_message(change.before),
        "after": from_message(change.after),
        "by": change.by,
        "together": change.together,
        "undoes": f"{change.component}{MARK}{change.undoes}" if change.undoes else None,
    }
