"""`param set`, `param load`, `param reset`, `param undo`: what changes values."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from rbxcompose.cli.bus.entities import NO_NAME
from rbxcompose.cli.bus.messages import to_json
from rbxcompose.cli.bus.parameter_nodes import ParameterNodes
from rbxcompose.cli.output.console import misused, refuse, tell, tell_report
from rbxcompose.cli.parameters.changed_values import change, changes_of
from rbxcompose.cli.parameters.listed_values import described
from rbxcompose.cli.parameters.texts import file_values, value_of
from rbxcompose.findings import Report
from rbxcompose.msgs.rbxcompose_parameters import ParameterChange
from rbxcompose.msgs.rcl_interfaces import Parameter, ParameterValue
from rbxcompose.params.core import SEPARATOR
from rbxcompose.params.history import NothingToUndoError, to_undo
from rbxcompose.params.values import to_message
from rbxcompose.units import written_unit

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
    change(nodes, wanted, "set")
    return _told(nodes, wanted, arguments, [written_unit(text) for _, _, text in pairs])


def param_load(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Set all parameters of a file."""
    report, sources = Report(), dict[str, str]()
    found = file_values(arguments.file, report, sources)
    if report.has_errors:
        tell_report(report, sources)
        return 1
    wanted = {nodes.find(name): list(each) for name, each in found.items() if each}
    change(nodes, wanted, "load")
    return _told(nodes, wanted, arguments)


def param_reset(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Set parameters to the values that the manifest has now."""
    from rbxcompose.cli.parameters.manifest_verbs import chosen, manifest_of  # the compiler, which only this needs

    live, _, _ = manifest_of(nodes, arguments)
    wanted: dict[str, list[Parameter]] = {}
    for one in chosen(list(live.changes), live, arguments.names):
        wanted.setdefault(live.node(one.component), []).append(Parameter(one.name, _message(one.written)))
    if not wanted:
        tell("[]" if arguments.json else "all values are those of the manifest")
        return 0
    change(nodes, wanted, "reset")
    return _told(nodes, wanted, arguments)


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
    change(nodes, wanted, "undo", {homes[one.component]: _first(one, found) for one in found}, expected)
    return _told(nodes, wanted, arguments)


def _first(one: ParameterChange, found: Sequence[ParameterChange]) -> int:
    return min(each.number for each in found if each.component == one.component)


def _is_pair(word: str) -> bool:
    path, equals, _ = word.partition("=")
    return bool(equals) and SEPARATOR in path


def _pair(word: str) -> tuple[str, str, str]:
    path, _, value = word.partition("=")
    component, _, name = path.partition(SEPARATOR)
    return component, name, value


def _message(value: object) -> ParameterValue:
    return to_message(value) or ParameterValue()


def _told(
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
