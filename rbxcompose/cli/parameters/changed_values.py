"""Changing parameters of several components at once: all of them, or nothing."""

from __future__ import annotations

import argparse
import fcntl
import getpass
import os
import signal
import sys
import time
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

from rbxcompose.cli.bus.entities import NO_NAME, NOBODY, SAID_NO
from rbxcompose.cli.bus.parameter_nodes import ParameterNodes
from rbxcompose.cli.robots.lookup import NotDoneError, find_robot, known_state
from rbxcompose.findings import Finding, kind
from rbxcompose.msgs.rbxcompose_parameters import ChangeParameters, ParameterChange
from rbxcompose.msgs.rcl_interfaces import (
    GetParameters,
    ListParameters,
    Parameter,
    ParameterType,
    SetParametersAtomically,
    SetParametersResult,
)
from rbxcompose.params.history import ChangeCause
from rbxcompose.params.transaction import Transaction
from rbxcompose.runtime.folder import RobotFolder, RobotState

HALF_DONE = kind(
    "RBX9047",
    """Parameters of several components were not set, and not all went back

All values are set, or none. If a component refuses at the last moment, those before it get their old values back. Here
one of them did not take its own back, because somebody has changed it meanwhile or it has failed. `rbxcompose param
history` tells who did what.

Bad: a component that fails while it takes a value.
Good: `rbxcompose param diff` shows what is set now; `param set` and `param undo` change it.
""",
)
CHANGE = "change_parameters"
_PATIENCE = 30.0  # [s] in which those before us are done: each of them compiles the robot
_PAUSE = 0.01  # [s] between two looks whether somebody else is done

Wanted = Mapping[str, Sequence[Parameter]]  # by node


def change(
    nodes: ParameterNodes,
    wanted: Wanted,
    arguments: argparse.Namespace,
    verb: str,
    undoes: Mapping[str, int] | None = None,
) -> None:
    """Set parameters of nodes, all or none, within the rules of the robot.

    Raises:
        NotDoneError: if they are not set, with the reason.
    """
    folder = None if arguments.router else find_robot(arguments.robot)
    state = known_state(folder) if folder else None
    with _turn_at(folder):
        known = known_values(nodes, wanted)
        if state is None:
            sys.stderr.write("the rules of the robot are not checked: its files are not known on this bus\n")
        elif broken := _broken_rules(nodes, wanted, state):
            raise NotDoneError(broken)
        cause = ChangeCause(f"{_user()}, param {verb}", uuid.uuid4().hex if _count(wanted) > 1 else "")
        transaction = Transaction(wanted, known, cause, undoes)
        with _uninterrupted():
            _carry_out(transaction, nodes)
    if transaction.refusal:
        raise NotDoneError(_refusal(transaction))


def known_values(nodes: ParameterNodes, wanted: Wanted) -> dict[str, tuple[Parameter, ...]]:
    """Return the values that parameters have now.

    Raises:
        NotDoneError: if there is no such parameter.
    """
    requests = [GetParameters.Request(names=tuple(one.name for one in each)) for each in wanted.values()]
    answers = nodes.ask(list(wanted), "get_parameters", GetParameters, requests)
    known = {}
    for (node, each), answer in zip(wanted.items(), answers, strict=True):
        if len(answer.values) != len(each):
            raise NotDoneError(SAID_NO.at(None, f"'{node}' does not tell its parameters"))
        for one, value in zip(each, answer.values, strict=True):
            if value.type == ParameterType.PARAMETER_NOT_SET:
                require_name(nodes, node, one.name)
        known[node] = tuple(Parameter(one.name, value) for one, value in zip(each, answer.values, strict=True))
    return known


def require_name(nodes: ParameterNodes, node: str, name: str) -> None:
    """Raise `NotDoneError` if a node has no such parameter."""
    (listed,) = nodes.ask([node], "list_parameters", ListParameters, [ListParameters.Request()])
    if name not in listed.result.names:
        words = f"'{node}' has no parameter '{name}'"
        raise NotDoneError(NO_NAME.misspelt(None, words, name, listed.result.names, "parameters"))


def changes_of(nodes: ParameterNodes, wanted: Sequence[str] | None = None) -> list[ParameterChange]:
    """Return the changes of nodes, or of all that keep some."""
    asked = [one for one in (nodes.names if wanted is None else wanted) if nodes.serves(one, CHANGE)]
    requests = [ChangeParameters.Request(only_check=True, tell_changes=True)] * len(asked)
    answers = nodes.ask(asked, CHANGE, ChangeParameters, requests)
    return [one for answer in answers for one in answer.changes]


def _carry_out(transaction: Transaction, nodes: ParameterNodes) -> None:
    while not transaction.is_over:
        for node, request in list(transaction.requests):
            try:
                transaction.take(node, _ask(nodes, node, request))
            except NotDoneError as error:
                transaction.take(node, None, error.finding.message)


def _ask(nodes: ParameterNodes, node: str, request: ChangeParameters.Request) -> ChangeParameters.Response:
    """Send a request; a node of ROS 2 that knows nothing of it is asked in its own way, and only at the end."""
    if nodes.serves(node, CHANGE):
        return nodes.ask([node], CHANGE, ChangeParameters, [request])[0]
    if request.only_check:
        return ChangeParameters.Response(success=True)
    atomically = SetParametersAtomically.Request(parameters=request.parameters)
    (answer,) = nodes.ask([node], "set_parameters_atomically", SetParametersAtomically, [atomically])
    result: SetParametersResult = answer.result
    return ChangeParameters.Response(success=result.successful, message=result.reason)


def _refusal(transaction: Transaction) -> Finding:
    reason = transaction.refusal
    if transaction.stuck:
        told = "; ".join(f"'{node}': {why}" for node, why in transaction.stuck.items())
        return HALF_DONE.at(None, f"{reason}; not all are as before: {told}")
    back = ", ".join(f"'{node}'" for node in transaction.went_back)
    return SAID_NO.at(None, reason + (f"; {back} went back to the values from before" if back else ""))


def _broken_rules(nodes: ParameterNodes, wanted: Wanted, state: RobotState) -> Finding | None:
    from rbxcompose.cli.robots.live_rules import why_not  # it imports the compiler, which only changes need

    return why_not(nodes, wanted, state)


def _count(wanted: Wanted) -> int:
    return sum(map(len, wanted.values()))


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):  # an account without a name
        return f"user {os.getuid()}"


@contextmanager
def _turn_at(folder: RobotFolder | None) -> Iterator[None]:
    """Wait until nobody else on this machine changes parameters of the robot, so that rules across components hold.

    The kernel ends the turn of a process that is dead.
    """
    if folder is None:
        yield
        return
    descriptor = os.open(folder.path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        deadline = time.monotonic() + _PATIENCE
        while not _is_locked(descriptor):
            if time.monotonic() > deadline:
                raise NotDoneError(NOBODY.at(None, f"somebody else is changing parameters of '{folder.path.name}'"))
            time.sleep(_PAUSE)
        yield
    finally:
        os.close(descriptor)


def _is_locked(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Let an interrupt wait: half of the values would be set."""
    noted: list[int] = []
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = {number: signal.signal(number, lambda number, frame: noted.append(number)) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for missed in noted[:1]:
            signal.raise_signal(missed)
