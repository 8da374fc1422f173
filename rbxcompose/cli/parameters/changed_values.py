"""Changing parameters of several components at once: all of them, or nothing."""

from __future__ import annotations

import getpass
import os
import uuid
from collections.abc import Mapping, Sequence

from rbxcompose.cli.bus.entities import NO_NAME, SAID_NO
from rbxcompose.cli.bus.parameter_nodes import ParameterNodes
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.findings import kind
from rbxcompose.msgs.rbxcompose_parameters import ChangeParameters, NodeChange, ParameterChange
from rbxcompose.msgs.rcl_interfaces import (
    GetParameters,
    ListParameters,
    Parameter,
    ParameterType,
    SetParametersAtomically,
)

HALF_DONE = kind("RBX9047")
BREAKS_RULE = kind("RBX9030")
CHANGE = "change_parameters"
Wanted = Mapping[str, Sequence[Parameter]]  # by node


def change(
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


def require_name(nodes: ParameterNodes, node: str, name: str) -> None:
    """Raise `NotDoneError` if a node has no such parameter."""
    (listed,) = nodes.ask([node], "list_parameters", ListParameters, [ListParameters.Request()])
    if name not in listed.result.names:
        words = f"'{node}' has no parameter '{name}'"
        raise NotDoneError(NO_NAME.misspelt(None, words, name, listed.result.names, "parameters"))


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
