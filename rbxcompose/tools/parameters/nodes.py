"""The nodes on a bus that have parameters, and their values: `param ls`, `get` and `describe`."""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.units import UNITS, Dimension
from rbxcompose.bus.graph import GraphName
from rbxcompose.bus.services import Client
from rbxcompose.commands.console import NotDoneError, emit, refuse, table
from rbxcompose.commands.guest import NAME, NO_NAME, NOBODY, SAID_NO, Guest
from rbxcompose.commands.messages import to_json, type_of
from rbxcompose.msgs import rcl_interfaces as rcl
from rbxcompose.msgs import registry
from rbxcompose.msgs.types import Message, Service
from rbxcompose.sdk.bound import Reply
from rbxcompose.sdk.parameters import TYPE_WORDS, dimension_in, from_message, shown

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)
_GET = "/get_parameters"
_WIDEST = 40  # characters of a value in a table
_KEYS = ("node", "name", "value", "read_only", "about")


class ParameterNodes:
    """The nodes on the bus that have parameters, by their `names`; `guest` is how they are reached."""

    def __init__(self, guest: Guest, timeout: float) -> None:
        """An answer may take `timeout` [s]."""
        self.guest, self._timeout = guest, timeout
        self._services: Mapping[str, GraphName] = {
            service.name: service for service in guest.graph().services if service.givers
        }
        self.names = sorted(name.removesuffix(_GET) for name in self._services if name.endswith(_GET))

    def find(self, wanted: str) -> str:
        """Return the full name of a node.

        Raises:
            NotDoneError: if no node of that name has parameters.
        """
        full = wanted if wanted.startswith("/") else f"/{wanted}"
        near = [name for name in self.names if name.endswith(full)]
        if full in self.names or len(near) == 1:
            return full if full in self.names else near[0]
        bare = [name.removeprefix("/") for name in self.names]
        words = f"no component '{wanted}' has parameters"
        raise NotDoneError(NO_NAME.misspelt(None, words, wanted.removeprefix("/"), bare, "components"))

    def serves(self, node: str, what: str) -> bool:
        """Return whether a node has a service, such as `set_parameters`."""
        return f"{node}/{what}" in self._services

    def ask(self, nodes: Sequence[str], what: str, service: type[Service[Q, R]], requests: Sequence[Q]) -> list[R]:
        """Request `what` from all `nodes` in parallel, and return their answers.

        Raises:
            NotDoneError: if one of them does not answer.
        """
        guest, replies = self.guest, dict[str, Reply[R]]()
        clients = [self._client(node, what) for node in nodes]
        guest.run(lambda: all(client.is_available for client in clients), self._timeout)
        for node, client, request in zip(nodes, clients, requests, strict=True):
            client(request, lambda reply, node=node: replies.update({node: reply}), timeout=self._timeout)  # type: ignore[misc]
        guest.run(lambda: len(replies) == len(nodes))
        return [_response(node, replies[node]) for node in nodes]

    def _client(self, node: str, what: str) -> Client[Any, Any]:
        found = self._services.get(f"{node}/{what}")
        if found is None:
            raise NotDoneError(NOBODY.at(None, f"'{node}' has no service '{what}'"))
        kind = found.kinds[0]
        return self.guest.bus(kind).client(NAME, found.name, type_of(kind, "srv", registry.service))


def _response(node: str, reply: Reply[R]) -> R:
    if reply.response is None:
        raise NotDoneError(SAID_NO.at(None, f"'{node}': {reply.error}"))
    return reply.response


@dataclass(frozen=True, slots=True)
class ListedParameter:
    """A parameter as its node reports it."""

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
        return dimension_in(self.about.description)

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
    return described(nodes, {node: answer.result.names for node, answer in zip(wanted, answers, strict=True)})


def described(nodes: ParameterNodes, names: dict[str, tuple[str, ...]]) -> list[ListedParameter]:
    """Return parameters of nodes by their names.

    Raises:
        NotDoneError: if one of the nodes does not answer.
    """
    having = {node: each for node, each in names.items() if each}
    gets = [rcl.GetParameters.Request(names=each) for each in having.values()]
    describes = [rcl.DescribeParameters.Request(names=each) for each in having.values()]
    values = nodes.ask(list(having), "get_parameters", rcl.GetParameters, gets)
    descriptions = nodes.ask(list(having), "describe_parameters", rcl.DescribeParameters, describes)
    return [
        ListedParameter(node, from_message(value), about)
        for node, got, one in zip(having, values, descriptions, strict=True)
        for value, about in zip(got.values, one.descriptors, strict=False)
    ]


def require_name(nodes: ParameterNodes, node: str, name: str) -> None:
    """Raise `NotDoneError` if a node has no such parameter."""
    (listed,) = nodes.ask([node], "list_parameters", rcl.ListParameters, [rcl.ListParameters.Request()])
    if name not in listed.result.names:
        words = f"'{node}' has no parameter '{name}'"
        raise NotDoneError(NO_NAME.misspelt(None, words, name, listed.result.names, "parameters"))


def param_ls(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """List parameters with their values."""
    wanted = [nodes.find(arguments.component)] if arguments.component else nodes.names
    found = listed(nodes, wanted)
    if arguments.json:
        emit(to_json([{key: data[key] for key in _KEYS} for data in map(_data, found)]))
        return 0
    rows = [("component", "parameter", "value", "", "about")]
    for parameter in found:
        about, value = parameter.about, parameter.text(parameter.value)[:_WIDEST]
        rows.append((parameter.node, about.name, value, "" if about.read_only else "live", about.description))
    emit(table(rows))
    return 0


def param_get(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Print the value of a parameter; without a name, list all of the component."""
    if arguments.name is None:
        return param_ls(nodes, arguments)
    node = nodes.find(arguments.component)
    (parameter,) = described(nodes, {node: (arguments.name,)}) or (None,)
    if parameter is None or parameter.about.type == rcl.ParameterType.PARAMETER_NOT_SET or parameter.value is None:
        require_name(nodes, node, arguments.name)
        return refuse(NO_NAME.at(None, f"'{node}' has no value for the parameter '{arguments.name}'"))
    emit(to_json(parameter.value) if arguments.json else parameter.text(parameter.value))
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
        emit(to_json([_data(listed_parameter) for listed_parameter in found]))
        return 0
    for parameter in found:
        emit(f"{parameter.node.removeprefix('/')}.{parameter.about.name} = {parameter.text(parameter.value)}")
        emit("\n".join(f"  {label:<10}{text}" for label, text in _lines(parameter) if text))
    return 0


def _lines(parameter: ListedParameter) -> Iterator[tuple[str, str]]:
    about = parameter.about
    yield "about", about.description
    yield "type", TYPE_WORDS.get(about.type, "not set")
    yield "may be", about.additional_constraints or _range(parameter)
    yield "step", _step(parameter)
    yield "group", about.name.rpartition(".")[0]
    yield "changes", "with a restart: change the manifest, then 'rbxcompose apply'" if about.read_only else "live"


def _range(parameter: ListedParameter) -> str:
    return ", ".join(
        f"{parameter.text(each.from_value)} to {parameter.text(each.to_value)}" for each in parameter.ranges
    )


def _step(parameter: ListedParameter) -> str:
    return ", ".join(parameter.text(each.step) for each in parameter.ranges if each.step)


def _data(parameter: ListedParameter) -> dict[str, object]:
    return {
        "node": parameter.node,
        "name": parameter.about.name,
        "type": TYPE_WORDS.get(parameter.about.type, "not set"),
        "value": parameter.value,
        "about": parameter.about.description,
        "constraints": parameter.about.additional_constraints,
        "ranges": [{"from": each.from_value, "to": each.to_value, "step": each.step} for each in parameter.ranges],
        "read_only": parameter.about.read_only,
    }
