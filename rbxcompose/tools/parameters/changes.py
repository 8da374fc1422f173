"""Changes of parameters: who made which (`param history`, `watch`), and all or none (`param set`, `load`, `undo`)."""

import argparse
import getpass
import os
import sys
import uuid
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from pathlib import Path

from rbxcompose.base.findings import Finding, Report, Span, kind
from rbxcompose.base.units import Dimension, written_unit
from rbxcompose.bus.graph import find
from rbxcompose.commands.console import NotDoneError, emit, misused, refuse, table, write_report
from rbxcompose.commands.guest import NO_NAME, SAID_NO, ReceivedMessage
from rbxcompose.commands.messages import to_json
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.reader import read_file, read_text
from rbxcompose.manifest.tree import MappingNode, TreeNode
from rbxcompose.manifest.validate import to_plain
from rbxcompose.msgs import rcl_interfaces as rcl
from rbxcompose.msgs.cdr import CdrError, decode
from rbxcompose.msgs.rbxcompose_parameters import ChangeParameters, NodeChange, ParameterChange
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.runtime.settings_history import MARK, ROS_TOOL, NothingToUndoError, identity, in_order, to_undo
from rbxcompose.sdk.parameters import SEPARATOR, dimension_in, from_message, shown, to_message
from rbxcompose.tools.parameters.nodes import ParameterNodes, described, require_name

CHANGE = "change_parameters"
_EVENTS = "/parameter_events"
_HEAD = ("change", "time", "parameter", "before", "after", "by")
_SECOND = 1e9  # [ns]
Dimensions = dict[tuple[str, str], Dimension | None]
NO_VALUES = kind("RBX9048")
PIPED = "-"
_ROS = "ros__parameters"
HALF_DONE = kind("RBX9047")
BREAKS_RULE = kind("RBX9030")
_WORDS = 3  # of a single change: component, parameter, value
Wanted = Mapping[str, Sequence[rcl.Parameter]]  # by node


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
    events: list[rcl.ParameterEvent] = []

    def received(message: ReceivedMessage) -> None:
        try:
            event = decode(rcl.ParameterEvent, message.arrival.payload)
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


def _of_event(nodes: ParameterNodes, event: rcl.ParameterEvent, seen: dict[str, int]) -> list[ParameterChange]:
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


def value_of(text: str) -> rcl.ParameterValue:
    """Read a number, a flag or a list in YAML; anything else is text."""
    root, findings = read_text(text, "VALUE")
    data = text if root is None or findings or isinstance(root, MappingNode) else to_plain(root)
    return to_message(text if data is None else data) or rcl.ParameterValue(
        type=rcl.ParameterType.PARAMETER_STRING, string_value=text
    )


def file_values(path: Path, report: Report, sources: dict[str, str]) -> dict[str, tuple[rcl.Parameter, ...]]:
    """Return the parameters in a file, by component, or `-` in what is piped in; mistakes go into `report`."""
    if str(path) == PIPED:
        sources[PIPED] = sys.stdin.read()
        root, findings = read_text(sources[PIPED], PIPED)
    else:
        root, findings = read_file(path, shown_name(path), sources)
    report.extend(findings)
    found: dict[str, tuple[rcl.Parameter, ...]] = {}
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


def _parameters(node: MappingNode, above: str, report: Report) -> list[rcl.Parameter]:
    found = []
    for name, entry in node.entries.items():
        path = f"{above}{SEPARATOR}{name}" if above else name
        if isinstance(entry.value, MappingNode):
            found += _parameters(entry.value, path, report)
        elif (value := _message(entry.value)) is None:
            report.add(NO_VALUES.at(entry.value.span, f"no parameter can have this value, as '{path}' has"))
        else:
            found.append(rcl.Parameter(path, value))
    return found


def _message(node: TreeNode) -> rcl.ParameterValue | None:
    value = to_plain(node)
    return None if value is None else to_message(value)


def _no_map(span: Span, what: str) -> Finding:
    return NO_VALUES.at(span, f"{what} must be a map", help="'rbxcompose param dump' shows the form")


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
    node = next(name for name in wanted if name not in ours)
    if len(wanted) > 1:
        message = f"'{node}' cannot change together with others: it is not a component with live settings"
        raise NotDoneError(SAID_NO.at(None, message, help="set its parameters alone"))
    atomically = rcl.SetParametersAtomically.Request(parameters=tuple(wanted[node]))
    (answer,) = nodes.ask([node], "set_parameters_atomically", rcl.SetParametersAtomically, [atomically])
    if not answer.result.successful:
        raise NotDoneError(SAID_NO.at(None, f"'{node}': {answer.result.reason}"))


def _require_names(nodes: ParameterNodes, wanted: Wanted) -> None:
    requests = [rcl.GetParameters.Request(names=tuple(one.name for one in each)) for each in wanted.values()]
    answers = nodes.ask(list(wanted), "get_parameters", rcl.GetParameters, requests)
    for (node, each), answer in zip(wanted.items(), answers, strict=True):
        if len(answer.values) != len(each):
            raise NotDoneError(SAID_NO.at(None, f"'{node}' does not report its parameters"))
        for parameter, value in zip(each, answer.values, strict=True):
            if value.type == rcl.ParameterType.PARAMETER_NOT_SET:
                require_name(nodes, node, parameter.name)


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):  # an account without a name
        return f"user {os.getuid()}"


def param_set(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Set one parameter, or several at once."""
    if not (pairs := assignments(arguments.words)):
        return misused("param", "write COMPONENT PARAMETER VALUE, or COMPONENT.PARAMETER=VALUE for each")
    wanted: dict[str, list[rcl.Parameter]] = {}
    for component, name, text in pairs:
        wanted.setdefault(nodes.find(component), []).append(rcl.Parameter(name, value_of(text)))
    change_values(nodes, wanted, "set")
    return write_values(nodes, wanted, arguments, [written_unit(text) for _, _, text in pairs])


def param_load(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Set all parameters of a file."""
    report, sources = Report(), dict[str, str]()
    found = file_values(arguments.file, report, sources)
    if report.has_errors:
        write_report(report, sources)
        return 1
    wanted = {nodes.find(name): list(each) for name, each in found.items() if each}
    change_values(nodes, wanted, "load")
    return write_values(nodes, wanted, arguments)


def param_undo(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Take back a change, with those that were made together with it."""
    known = {node: changes_of(nodes, [node]) for node in nodes.names}
    homes = {parameter_change.component: node for node, each in known.items() for parameter_change in each}
    try:
        found = to_undo([parameter_change for each in known.values() for parameter_change in each], arguments.change)
    except NothingToUndoError as error:
        return refuse(NO_NAME.at(None, str(error), help="'rbxcompose param history' lists the changes"))
    wanted: dict[str, list[rcl.Parameter]] = {}
    expected: dict[str, list[rcl.Parameter]] = {}
    undoes: dict[str, int] = {}
    for change in sorted(found, key=lambda each: each.component):  # processes report a change in any order
        node = homes[change.component]
        wanted.setdefault(node, []).append(rcl.Parameter(change.name, change.before))
        expected.setdefault(node, []).append(rcl.Parameter(change.name, change.after))
        undoes[node] = min(change.number, undoes.get(node, change.number))
    change_values(nodes, wanted, "undo", undoes, expected)
    return write_values(nodes, wanted, arguments)


def assignments(words: Sequence[str]) -> list[tuple[str, str, str]]:
    """Return component, parameter and value of each change that the words of `param set` mean; none if they do not."""
    if len(words) == _WORDS and "=" not in words[0]:
        return [(words[0], words[1], words[2])]
    found = []
    for path, equals, value in (word.partition("=") for word in words):
        component, separator, name = path.partition(SEPARATOR)
        if not equals or not separator:
            return []
        found.append((component, name, value))
    return found


def message_of(value: object) -> rcl.ParameterValue:
    """Return a value as a message; one that has no message counts as not set."""
    return to_message(value) or rcl.ParameterValue()


def write_values(
    nodes: ParameterNodes,
    wanted: dict[str, list[rcl.Parameter]],
    arguments: argparse.Namespace,
    units: Sequence[str | None] = (),
) -> int:
    """Tell the values that parameters have now; a single one alone, as `get` does."""
    found = described(nodes, {node: tuple(parameter.name for parameter in each) for node, each in wanted.items()})
    if len(found) == 1 and arguments.action == "set":
        one, unit = found[0], (units or (None,))[0]
        emit(to_json(one.value) if arguments.json else one.text(one.value, unit))
        return 0
    if arguments.json:
        emit(to_json([{"node": item.node, "name": item.about.name, "value": item.value} for item in found]))
        return 0
    for one in found:
        emit(f"{one.node.removeprefix('/')}.{one.about.name} = {one.text(one.value)}")
    return 0
