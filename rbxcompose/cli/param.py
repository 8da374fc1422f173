"""List, get or set the parameters of components while the robot runs, and of ROS 2 nodes.

Numbers are SI. `set` takes text with a unit as well (`param set battery runtime "30 s"`). A change lasts until
the process ends; write it in the manifest to keep it.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from rbxcompose.bus.graph import GraphName
from rbxcompose.bus.services import Client
from rbxcompose.cli.bus.entities import (
    NO_NAME,
    NOBODY,
    SAID_NO,
    add_json_option,
    add_timeout_option,
    table,
    visit,
)
from rbxcompose.cli.bus.guest import NAME, Guest
from rbxcompose.cli.bus.messages import to_json, type_of
from rbxcompose.cli.bus.place import add_bus_options
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.manifest.validate import to_plain
from rbxcompose.msgs import rcl_interfaces as rcl
from rbxcompose.msgs import registry
from rbxcompose.msgs.types import Message, Service
from rbxcompose.params.values import from_message, to_message
from rbxcompose.sdk.bound import Reply

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)

_GET = "/get_parameters"
_WIDEST = 40  # characters of a value in a table
_KEYS = ("node", "name", "value", "read_only", "about")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="ls|get|set", required=True)
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
    for one in (ls, get, set_):
        add_timeout_option(one, "5s")
        add_json_option(one)
        add_bus_options(one)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    return visit(arguments, lambda guest: int(arguments.do(_Nodes(guest, arguments.timeout), arguments)))


class _Nodes:
    """The nodes on the bus that have parameters."""

    def __init__(self, guest: Guest, timeout: float) -> None:
        self._guest, self._timeout = guest, timeout
        self._services: Mapping[str, GraphName] = {one.name: one for one in guest.graph().services if one.givers}
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

    def ask(self, nodes: Sequence[str], what: str, service: type[Service[Q, R]], requests: Sequence[Q]) -> list[R]:
        """Request `what` from all `nodes` in parallel, and return their answers.

        Raises:
            NotDoneError: if one of them does not answer.
        """
        guest, replies = self._guest, dict[str, Reply[R]]()
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
        return self._guest.bus(kind).client(NAME, found.name, type_of(kind, "srv", registry.service))


def _response(node: str, reply: Reply[R]) -> R:
    if reply.response is None:
        raise NotDoneError(SAID_NO.at(None, f"'{node}': {reply.error}"))
    return reply.response


def _ls(nodes: _Nodes, arguments: argparse.Namespace) -> int:
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
        (node, name, _shown(value)[:_WIDEST], "" if fixed else "live", about)
        for node, name, value, fixed, about in found
    ]
    tell(table([("component", "parameter", "value", "", "about"), *rows]))
    return 0


def _get(nodes: _Nodes, arguments: argparse.Namespace) -> int:
    node = nodes.find(arguments.component)
    request = rcl.GetParameters.Request(names=(arguments.name,))
    (answer,) = nodes.ask([node], "get_parameters", rcl.GetParameters, [request])
    values = [one for one in answer.values if one.type != rcl.ParameterType.PARAMETER_NOT_SET]
    if not values:
        (listed,) = nodes.ask([node], "list_parameters", rcl.ListParameters, [rcl.ListParameters.Request()])
        words = f"'{node}' has no value for a parameter '{arguments.name}'"
        return refuse(NO_NAME.misspelt(None, words, arguments.name, listed.result.names, "parameters"))
    value = from_message(values[0])
    tell(to_json(value) if arguments.json else _shown(value))
    return 0


def _set(nodes: _Nodes, arguments: argparse.Namespace) -> int:
    node = nodes.find(arguments.component)
    parameter = rcl.Parameter(name=arguments.name, value=_value(arguments.value))
    request = rcl.SetParameters.Request(parameters=(parameter,))
    (answer,) = nodes.ask([node], "set_parameters", rcl.SetParameters, [request])
    result = answer.results[0] if answer.results else rcl.SetParametersResult(reason="its answer was empty")
    if not result.successful:
        return refuse(SAID_NO.at(None, f"'{node}': {result.reason}"))
    return _get(nodes, arguments)


def _value(text: str) -> rcl.ParameterValue:
    """Read a number, a flag or a list in YAML; anything else is text."""
    root, findings = read_text(text, "VALUE")
    data = text if root is None or findings or isinstance(root, MappingNode) else to_plain(root)
    return to_message(text if data is None else data) or rcl.ParameterValue(
        type=rcl.ParameterType.PARAMETER_STRING, string_value=text
    )


def _shown(value: object) -> str:
    return value if isinstance(value, str) else to_json(value)
