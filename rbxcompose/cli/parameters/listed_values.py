"""`param ls`, `param get`, `param describe`: what components and nodes tell about their parameters."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence

from rbxcompose.cli.bus.entities import NO_NAME, table
from rbxcompose.cli.bus.messages import to_json
from rbxcompose.cli.bus.parameter_nodes import ParameterNodes
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.cli.parameters.changed_values import require_name
from rbxcompose.dataclass import dataclass
from rbxcompose.msgs import rcl_interfaces as rcl
from rbxcompose.params.core import shown, told_dimension
from rbxcompose.params.values import TYPE_WORDS, from_message
from rbxcompose.units import UNITS, Dimension

_WIDEST = 40  # characters of a value in a table
_KEYS = ("node", "name", "value", "read_only", "about")


@dataclass(frozen=True, slots=True)
class ListedParameter:
    """A parameter as its node tells it."""

    node: str
    value: object
    about: rcl.ParameterDescriptor

    @property
    def ranges(self) -> Sequence[rcl.FloatingPointRange | rcl.IntegerRange]:
        """Return the ranges of its value."""
        return [*self.about.floating_point_range, *self.about.integer_range]

    @property
    def dimension(self) -> Dimension | None:
        """Return its dimension, None if it is not a quantity or that of a foreign node."""
        return told_dimension(self.about.description)

    def text(self, value: object, unit: str | None = None) -> str:
        """Return a value of it for people."""
        known = unit if unit and UNITS[unit].dimension == self.dimension else None
        return shown(value, self.dimension, known)


def listed(nodes: ParameterNodes, wanted: Sequence[str]) -> list[ListedParameter]:
    """Return all parameters of nodes.

    Raises:
        NotDoneError: if one of them does not answer.
    """
    requests = [rcl.ListParameters.Request()] * len(wanted)
    answers = nodes.ask(wanted, "list_parameters", rcl.ListParameters, requests)
    return described(nodes, {node: one.result.names for node, one in zip(wanted, answers, strict=True)})


def described(nodes: ParameterNodes, names: dict[str, tuple[str, ...]]) -> list[ListedParameter]:
    """Return parameters of nodes by their names.

    Raises:
        NotDoneError: if one of the nodes does not answer.
    """
    having = {node: each for node, each in names.items() if each}
    gets = [rcl.GetParameters.Request(names=each) for each in having.values()]
    describes = [rcl.DescribeParameters.Request(names=each) for each in having.values()]
    values = nodes.ask(list(having), "get_parameters", rcl.GetParameters, gets)
    told = nodes.ask(list(having), "describe_parameters", rcl.DescribeParameters, describes)
    return [
        ListedParameter(node, from_message(value), about)
        for node, got, one in zip(having, values, told, strict=True)
        for value, about in zip(got.values, one.descriptors, strict=False)
    ]


def param_ls(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """List parameters with their values."""
    wanted = [nodes.find(arguments.component)] if arguments.component else nodes.names
    found = listed(nodes, wanted)
    if arguments.json:
        rows = [(one.node, one.about.name, one.value, one.about.read_only, one.about.description) for one in found]
        tell(to_json([dict(zip(_KEYS, row, strict=True)) for row in rows]))
        return 0
    cells = [
        (
            one.node,
            one.about.name,
            one.text(one.value)[:_WIDEST],
            "" if one.about.read_only else "live",
            one.about.description,
        )
        for one in found
    ]
    tell(table([("component", "parameter", "value", "", "about"), *cells]))
    return 0


def param_get(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Print the value of a parameter."""
    node = nodes.find(arguments.component)
    (one,) = described(nodes, {node: (arguments.name,)}) or (None,)
    if one is None or one.about.type == rcl.ParameterType.PARAMETER_NOT_SET or one.value is None:
        require_name(nodes, node, arguments.name)
        return refuse(NO_NAME.at(None, f"'{node}' has no value for the parameter '{arguments.name}'"))
    tell(to_json(one.value) if arguments.json else one.text(one.value))
    return 0


def param_describe(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Tell what parameters are."""
    node = nodes.find(arguments.component)
    if arguments.name:
        require_name(nodes, node, arguments.name)
        found = described(nodes, {node: (arguments.name,)})
    else:
        found = listed(nodes, [node])
    if arguments.json:
        tell(to_json([_data(one) for one in found]))
        return 0
    for one in found:
        tell(f"{one.node.removeprefix('/')}.{one.about.name} = {one.text(one.value)}")
        tell("\n".join(f"  {label:<10}{text}" for label, text in _lines(one) if text))
    return 0


def _lines(one: ListedParameter) -> Iterator[tuple[str, str]]:
    about = one.about
    yield "about", about.description
    yield "type", TYPE_WORDS.get(about.type, "not set")
    yield "may be", about.additional_constraints or _range(one)
    yield "step", _step(one)
    yield "group", about.name.rpartition(".")[0]
    yield "changes", "with a restart: change the manifest, then 'rbxcompose apply'" if about.read_only else "live"


def _range(one: ListedParameter) -> str:
    return ", ".join(f"{one.text(each.from_value)} to {one.text(each.to_value)}" for each in one.ranges)


def _step(one: ListedParameter) -> str:
    return ", ".join(one.text(each.step) for each in one.ranges if each.step)


def _data(one: ListedParameter) -> dict[str, object]:
    return {
        "node": one.node,
        "name": one.about.name,
        "type": TYPE_WORDS.get(one.about.type, "not set"),
        "value": one.value,
        "about": one.about.description,
        "constraints": one.about.additional_constraints,
        "ranges": [{"from": each.from_value, "to": each.to_value, "step": each.step} for each in one.ranges],
        "read_only": one.about.read_only,
    }
