"""List, get or set the parameters of components while the robot runs, and of ROS 2 nodes.

A value is written as in a manifest (`param set battery runtime "30 s"`); a bare number is SI, and so is JSON. `set`
refuses what `check` would refuse, with the values that all components have now. A change lasts until the process ends;
`save` writes it into the manifest, at its place.
"""

from __future__ import annotations

import argparse
import sys

from rbxcompose.cli.bus.entities import (
    NO_NAME,
    SAID_NO,
    add_json_option,
    add_timeout_option,
    table,
    visit,
)
from rbxcompose.cli.bus.messages import to_json
from rbxcompose.cli.bus.parameter_nodes import ParameterNodes
from rbxcompose.cli.bus.place import add_bus_options
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.cli.robots.lookup import find_robot, known_state
from rbxcompose.findings import Finding
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.manifest.validate import to_plain
from rbxcompose.msgs import rcl_interfaces as rcl
from rbxcompose.params.core import shown, told_dimension
from rbxcompose.params.values import from_message, to_message
from rbxcompose.runtime.folder import RobotState
from rbxcompose.units import UNITS, written_unit

_WIDEST = 40  # characters of a value in a table
_KEYS = ("node", "name", "value", "read_only", "about")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="ls|get|set|save", required=True)
    ls = actions.add_parser("ls", help="list parameters with their values")
    ls.add_argument("component", metavar="COMPONENT", nargs="?", help="only those of this component or node")
    ls.set_defaults(do=_ls)
    get = actions.add_parser("get", help="print the value of a parameter")
    get.set_defaults(do=_get)
    set_ = actions.add_parser("set", help="change a parameter")
    set_.set_defaults(do=_set)
    for one in (get, set_):
        one.add_argument("component", metavar="COMPONENT", help="a component or node, such as battery")
        one.add_argument("name", metavar="NAME", help="the parameter, such as runtime")
    set_.add_argument("value", metavar="VALUE", help="as in a manifest: '30 s', 0.5, true, [1, 2]")
    save = actions.add_parser("save", help="write changed values into the manifest, each at its place")
    save.add_argument("names", metavar="NAME", nargs="*", help="only these: battery, or battery.runtime")
    save.add_argument("--dry-run", action="store_true", help="only show what would be written")
    save.set_defaults(do=_save)
    for one in (ls, get, set_, save):
        add_timeout_option(one, "5s")
        add_json_option(one)
        add_bus_options(one)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    return visit(arguments, lambda guest: int(arguments.do(ParameterNodes(guest, arguments.timeout), arguments)))


def _ls(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    wanted = [nodes.find(arguments.component)] if arguments.component else nodes.names
    listed = nodes.ask(wanted, "list_parameters", rcl.ListParameters, [rcl.ListParameters.Request()] * len(wanted))
    having = {node: one.result.names for node, one in zip(wanted, listed, strict=True) if one.result.names}
    each = list(having.values())
    values = nodes.ask(
        list(having), "get_parameters", rcl.GetParameters, [rcl.GetParameters.Request(names=names) for names in each]
    )
    told = nodes.ask(
        list(having),
        "describe_parameters",
        rcl.DescribeParameters,
        [rcl.DescribeParameters.Request(names=names) for names in each],
    )
    found = [
        (node, about.name, from_message(value), about.read_only, about.description)
        for node, got, described in zip(having, values, told, strict=True)
        for value, about in zip(got.values, described.descriptors, strict=True)
    ]
    if arguments.json:
        tell(to_json([dict(zip(_KEYS, one, strict=True)) for one in found]))
        return 0
    rows = [
        (node, name, shown(value, told_dimension(about))[:_WIDEST], "" if fixed else "live", about)
        for node, name, value, fixed, about in found
    ]
    tell(table([("component", "parameter", "value", "", "about"), *rows]))
    return 0


def _get(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    node = nodes.find(arguments.component)
    request = rcl.GetParameters.Request(names=(arguments.name,))
    (answer,) = nodes.ask([node], "get_parameters", rcl.GetParameters, [request])
    values = [one for one in answer.values if one.type != rcl.ParameterType.PARAMETER_NOT_SET]
    if not values:
        (listed,) = nodes.ask([node], "list_parameters", rcl.ListParameters, [rcl.ListParameters.Request()])
        words = f"'{node}' has no value for a parameter '{arguments.name}'"
        return refuse(NO_NAME.misspelt(None, words, arguments.name, listed.result.names, "parameters"))
    value = from_message(values[0])
    tell(to_json(value) if arguments.json else _as_written(nodes, node, arguments, value))
    return 0


def _as_written(nodes: ParameterNodes, node: str, arguments: argparse.Namespace, value: object) -> str:
    """Return a value for people, in the unit in which it was given."""
    request = rcl.DescribeParameters.Request(names=(arguments.name,))
    (answer,) = nodes.ask([node], "describe_parameters", rcl.DescribeParameters, [request])
    dimension = told_dimension(answer.descriptors[0].description) if answer.descriptors else None
    unit = written_unit(getattr(arguments, "value", ""))
    return shown(value, dimension, unit if unit and UNITS[unit].dimension == dimension else None)


def _set(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    node = nodes.find(arguments.component)
    parameter = rcl.Parameter(name=arguments.name, value=_value(arguments.value))
    state = None if arguments.router else known_state(find_robot(arguments.robot))
    if state is None:
        sys.stderr.write("the rules of the robot are not checked: its files are not known on this bus\n")
    elif broken := _broken_rules(nodes, node, parameter, state):
        return refuse(broken)
    request = rcl.SetParameters.Request(parameters=(parameter,))
    (answer,) = nodes.ask([node], "set_parameters", rcl.SetParameters, [request])
    result = answer.results[0] if answer.results else rcl.SetParametersResult(reason="its answer was empty")
    if not result.successful:
        return refuse(SAID_NO.at(None, f"'{node}': {result.reason}"))
    return _get(nodes, arguments)


def _broken_rules(nodes: ParameterNodes, node: str, parameter: rcl.Parameter, state: RobotState) -> Finding | None:
    from rbxcompose.cli.robots.live_rules import why_not  # it imports the compiler, which only `set` needs

    return why_not(nodes, {node: [parameter]}, state)


def _save(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    from rbxcompose.cli.parameters.manifest_verbs import save  # it imports the compiler

    return save(nodes, arguments)


def _value(text: str) -> rcl.ParameterValue:
    """Read a number, a flag or a list in YAML; anything else is text."""
    root, findings = read_text(text, "VALUE")
    data = text if root is None or findings or isinstance(root, MappingNode) else to_plain(root)
    return to_message(text if data is None else data) or rcl.ParameterValue(
        type=rcl.ParameterType.PARAMETER_STRING, string_value=text
    )
