"""What changes parameters, and who did: `param set`, `load`, `reset`, `undo`, `history` and `watch`."""

from __future__ import annotations

import argparse
import getpass
import os
import sys
import uuid
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from pathlib import Path

from rbxcompose.bus.graph import find
from rbxcompose.cli.bus.guest import NO_NAME, SAID_NO, HeardMessage
from rbxcompose.cli.bus.messages import to_json
from rbxcompose.cli.output.console import NotDoneError, misused, refuse, table, tell, tell_report
from rbxcompose.cli.parameters.nodes import ParameterNodes, described, require_name
from rbxcompose.composition.value_edits import value_text
from rbxcompose.findings import Finding, Report, Span, kind
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.reader import read_file, read_text
from rbxcompose.manifest.tree import MappingNode, TreeNode
from rbxcompose.manifest.validate import to_plain
from rbxcompose.msgs.cdr import CdrError, decode
from rbxcompose.msgs.rbxcompose_parameters import ChangeParameters, NodeChange, ParameterChange
from rbxcompose.msgs.rcl_interfaces import (
    GetParameters,
    Parameter,
    ParameterEvent,
    ParameterType,
    ParameterValue,
    SetParametersAtomically,
)
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.params.core import SEPARATOR, shown, told_dimension
from rbxcompose.params.history import MARK, ROS_TOOL, NothingToUndoError, identity, in_order, to_undo
from rbxcompose.params.values import from_message, to_message
from rbxcompose.units import Dimension, written_unit

NO_VALUES = kind("RBX9048")
PIPED = "-"
_ROS = "ros__parameters"


def value_of(text: str) -> ParameterValue:
    """Read a number, a flag or a list in YAML; anything else is text."""
    root, findings = read_text(text, "VALUE")
    data = text if root is None or findings or isinstance(root, MappingNode) else to_plain(root)
    return to_message(text if data is None else data) or ParameterValue(
        type=ParameterType.PARAMETER_STRING, string_value=text
    )


def exact_text(value: object, dimension: Dimension | None) -> str:
    """Return a value as `value_of` reads it, exact to the last but one bit."""
    return value_text(value, dimension).replace("$$", "$")


def file_values(path: Path, report: Report, sources: dict[str, str]) -> dict[str, tuple[Parameter, ...]]:
    """Return the parameters in a file, by component, or `-` in what is piped in; mistakes go into `report`."""
    if str(path) == PIPED:
        sources[PIPED] = sys.stdin.read()
        root, findings = read_text(sources[PIPED], PIPED)
    else:
        root, findings = read_file(path, shown_name(path), sources)
    report.extend(findings)
    found: dict[str, tuple[Parameter, ...]] = {}
    if root is None:
        return found
    if not isinstance(root, MappingNode):
        report.add(_no_map(root.span, "components"))
        return found
    for name, entry in root.entries.items():
        values = entry.value
        if isinstance(values, MappingNode) and list(values.entries) == [_ROS]:
            values = values.entries[_ROS].value
        if isinstance(values, MappingNode):
            found[name] = tuple(_parameters(values, "", report))
        else:
            report.add(_no_map(values.span, f"the parameters of '{name}'"))
    return found


def _parameters(node: MappingNode, above: str, report: Report) -> list[Parameter]:
    found = []
    for name, entry in node.entries.items():
        path = f"{above}{SEPARATOR}{name}" if above else name
        if isinstance(entry.value, MappingNode):
            found += _parameters(entry.value, path, report)
        elif (value := _message(entry.value)) is None:
            report.add(NO_VALUES.at(entry.value.span, f"no parameter can have this value, as '{path}' has"))
        else:
            found.append(Parameter(path, value))
    return found


def _message(node: TreeNode) -> ParameterValue | None:
    value = to_plain(node)
    return None if value is None else to_message(value)


def _no_map(span: Span, what: str) -> Finding:
    return NO_VALUES.at(span, f"{what} must be a map", help="'rbxcompose param dump' shows the form")


HALF_DONE = kind("RBX9047")
BREAKS_RULE = kind("RBX9030")
CHANGE = "change_parameters"
Wanted = Mapping[str, Sequence[Parameter]]  # by node


def change_values(
    nodes: ParameterNodes,
    wanted: Wanted,
    verb: str,
    undoes: Mapping[str, int] | None = None,
    known: Wanted | None = None,
) -> None:
    """Set parameters of nodes, all or none, if they still have the `known` values.

    The robot decides, and goes on with it whatever becomes of this process.

    Raises:
        NotDoneError: if they are not set, with the reason.
    """
    if not wanted:
        return
    _require_names(nodes, wanted)
    ours = [node for node in wanted if nodes.serves(node, CHANGE)]
    if len(ours) < len(wanted):
        _change_foreign(nodes, wanted, ours)
        return
    parts = [
        NodeChange(node, tuple(each), tuple((known or {}).get(node, ())), (undoes or {}).get(node, 0))
        for node, each in wanted.items()
    ]
    together = uuid.uuid4().hex if sum(map(len, wanted.values())) > 1 else ""
    request = ChangeParameters.Request(others=tuple(parts), by=f"{_user()}, param {verb}", together=together)
    (answer,) = nodes.ask(ours[:1], CHANGE, ChangeParameters, [request])
    if not answer.success:
        finding = BREAKS_RULE if answer.breaks_rule else HALF_DONE if answer.is_half_done else SAID_NO
        where = f"'{ours[0]}': " if finding is SAID_NO and not together else ""
        raise NotDoneError(finding.at(None, f"{where}{answer.message}", help=answer.help))


def _change_foreign(nodes: ParameterNodes, wanted: Wanted, ours: Sequence[str]) -> None:
    """Set the parameters of one node that knows nothing of changes together with others."""
    node = next(one for one in wanted if one not in ours)
    if len(wanted) > 1:
        message = f"'{node}' cannot change together with others: it is no component with live settings"
        raise NotDoneError(SAID_NO.at(None, message, help="set its parameters alone"))
    atomically = SetParametersAtomically.Request(parameters=tuple(wanted[node]))
    (answer,) = nodes.ask([node], "set_parameters_atomically", SetParametersAtomically, [atomically])
    if not answer.result.successful:
        raise NotDoneError(SAID_NO.at(None, f"'{node}': {answer.result.reason}"))


def _require_names(nodes: ParameterNodes, wanted: Wanted) -> None:
    requests = [GetParameters.Request(names=tuple(one.name for one in each)) for each in wanted.values()]
    answers = nodes.ask(list(wanted), "get_parameters", GetParameters, requests)
    for (node, each), answer in zip(wanted.items(), answers, strict=True):
        if len(answer.values) != len(each):
            raise NotDoneError(SAID_NO.at(None, f"'{node}' does not tell its parameters"))
        for one, value in zip(each, answer.values, strict=True):
            if value.type == ParameterType.PARAMETER_NOT_SET:
                require_name(nodes, node, one.name)


def changes_of(nodes: ParameterNodes, wanted: Sequence[str] | None = None) -> list[ParameterChange]:
    """Return the changes of nodes, or of all that keep some."""
    asked = [one for one in (nodes.names if wanted is None else wanted) if nodes.serves(one, CHANGE)]
    requests = [ChangeParameters.Request(tell_changes=True)] * len(asked)
    answers = nodes.ask(asked, CHANGE, ChangeParameters, requests)
    return [one for answer in answers for one in answer.changes]


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):  # an account without a name
        return f"user {os.getuid()}"


_WORDS = 3  # of a single change: component, parameter, value


def param_set(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Set one parameter, or several at once."""
    words = arguments.words
    if len(words) == _WORDS and "=" not in words[0]:
        pairs = [(words[0], words[1], words[2])]
    elif all(_is_pair(word) for word in words):
        pairs = [_pair(word) for word in words]
    else:
        return misused("param", "write COMPONENT PARAMETER VALUE, or COMPONENT.PARAMETER=VALUE for each")
    wanted: dict[str, list[Parameter]] = {}
    for component, name, text in pairs:
        wanted.setdefault(nodes.find(component), []).append(Parameter(name, value_of(text)))
    change_values(nodes, wanted, "set")
    return tell_values(nodes, wanted, arguments, [written_unit(text) for _, _, text in pairs])


def param_load(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Set all parameters of a file."""
    report, sources = Report(), dict[str, str]()
    found = file_values(arguments.file, report, sources)
    if report.has_errors:
        tell_report(report, sources)
        return 1
    wanted = {nodes.find(name): list(each) for name, each in found.items() if each}
    change_values(nodes, wanted, "load")
    return tell_values(nodes, wanted, arguments)


def param_undo(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Take back a change, with those that were made together with it."""
    known = {node: changes_of(nodes, [node]) for node in nodes.names}
    homes = {one.component: node for node, each in known.items() for one in each}
    try:
        found = to_undo([one for each in known.values() for one in each], arguments.change)
    except NothingToUndoError as error:
        return refuse(NO_NAME.at(None, str(error), help="'rbxcompose param history' lists the changes"))
    wanted: dict[str, list[Parameter]] = {}
    for one in sorted(found, key=lambda each: each.component):  # processes tell of a change in any order
        wanted.setdefault(homes[one.component], []).append(Parameter(one.name, one.before))
    expected: dict[str, list[Parameter]] = {}
    for one in found:
        expected.setdefault(homes[one.component], []).append(Parameter(one.name, one.after))
    change_values(nodes, wanted, "undo", {homes[one.component]: _first(one, found) for one in found}, expected)
    return tell_values(nodes, wanted, arguments)


def _first(one: ParameterChange, found: Sequence[ParameterChange]) -> int:
    return min(each.number for each in found if each.component == one.component)


def _is_pair(word: str) -> bool:
    path, equals, _ = word.partition("=")
    return bool(equals) and SEPARATOR in path


def _pair(word: str) -> tuple[str, str, str]:
    path, _, value = word.partition("=")
    component, _, name = path.partition(SEPARATOR)
    return component, name, value


def message_of(value: object) -> ParameterValue:
    """Return a value as a message; one that has no message counts as not set."""
    return to_message(value) or ParameterValue()


def tell_values(
    nodes: ParameterNodes,
    wanted: dict[str, list[Parameter]],
    arguments: argparse.Namespace,
    units: Sequence[str | None] = (),
) -> int:
    """Tell the values that parameters have now; a single one alone, as `get` does."""
    found = described(nodes, {node: tuple(one.name for one in each) for node, each in wanted.items()})
    if len(found) == 1 and arguments.action == "set":
        one, unit = found[0], (units or (None,))[0]
        tell(to_json(one.value) if arguments.json else one.text(one.value, unit))
        return 0
    if arguments.json:
        tell(to_json([{"node": one.node, "name": one.about.name, "value": one.value} for one in found]))
        return 0
    for one in found:
        tell(f"{one.node.removeprefix('/')}.{one.about.name} = {one.text(one.value)}")
    return 0


_EVENTS = "/parameter_events"
_HEAD = ("change", "time", "parameter", "before", "after", "by")
_SECOND = 1e9  # [ns]
Dimensions = dict[tuple[str, str], Dimension | None]


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
