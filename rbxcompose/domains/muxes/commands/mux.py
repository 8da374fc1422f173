"""Show who may command and why; select, add, delete or lock the inputs of muxes of a running robot.

Without a MUX, the only one of the robot is meant. What is added, deleted, selected or locked here lasts until the robot
goes down; write it in the manifest to keep it.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterator

from rbxcompose.base.findings import clauses, suggest
from rbxcompose.base.requests import Command, to_data
from rbxcompose.commands.console import NotDoneError, emit, table
from rbxcompose.commands.lookup import REFUSED, add_asking_options, answer_of, find_robot, known_state, show_answer
from rbxcompose.commands.options import Subcommand, add_actions, argument, count, run_action, seconds
from rbxcompose.domains.muxes import requests
from rbxcompose.runtime.folder import RobotFolder

GROUP = "drive"
ON_SYSTEM = requests.MUX
FOR_ALL = ("ls", "why", "lock")
_LOOK = 0.2  # [s] between two looks of `watch`; no change is missed between them


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    maybe = argument("names", metavar="MUX", nargs="*", help="the mux, if the robot has several")
    words = "the mux, if there are several, and the input"
    one_input = argument("names", metavar="MUX|INPUT", nargs="+", help=words)
    inputs = argument("names", metavar="MUX|INPUT", nargs="*", help="the mux, if there are several, and inputs")
    until = argument("-n", "--count", type=count, metavar="N", help="end after N changes")
    topic = argument("--topic", metavar="TOPIC", default="", help="its topic, if that is not MUX/INPUT")
    priority = argument("--priority", type=int, metavar="N", help="its priority; only where priorities count")
    timeout = argument("--timeout", type=seconds, metavar="T", help="it counts as silent after this time")
    while_ = argument("--for", dest="seconds", type=seconds, metavar="T", help="unlock them after this time")
    select = "let an input through, in the mode `select`; '__none' for none"
    actions = (
        Subcommand("ls", "list muxes, their modes, and who holds each output", _ls),
        Subcommand("why", "show who holds an output until when, and what keeps the others from it", _why, (maybe,)),
        Subcommand("watch", "print each change of who holds an output, until interrupted", _watch, (until, maybe)),
        Subcommand("select", select, _select, (one_input,)),
        Subcommand("add", "add an input", _add, (topic, priority, timeout, one_input)),
        Subcommand("delete", "remove an input", _delete, (one_input,)),
        Subcommand("lock", "hold inputs back by hand, all if none is named", _lock, (while_, inputs)),
        Subcommand("unlock", "end what was locked by hand", _unlock, (inputs,), "What still commands goes on at once."),
    )
    add_actions(parser, actions, add_asking_options, metavar="ls|why|select|lock|...")


run = run_action


def _names(folder: RobotFolder) -> list[str]:
    """Return the muxes of a robot."""
    state = known_state(folder)
    return [component.name for component in state.components if component.type == requests.MUX] if state else []


def _chosen(arguments: argparse.Namespace, folder: RobotFolder) -> tuple[str, list[str]]:
    """Return the mux that is meant, and the inputs; the first of the names may be that of the mux."""
    known, given = _names(folder), list(arguments.names)
    if given and given[0] in known:
        return given[0], given[1:]
    if len(known) == 1:
        return known[0], given
    if not known:
        raise NotDoneError(REFUSED.at(None, "this robot has no mux"))
    first = f"there is no mux '{given[0]}'" if given else "this robot has several muxes, so name one"
    raise NotDoneError(REFUSED.at(None, clauses(first, suggest(given[0] if given else "", known, "muxes"))))


def _only_mux(arguments: argparse.Namespace, folder: RobotFolder) -> str:
    mux, others = _chosen(arguments, folder)
    if others:
        raise NotDoneError(
            REFUSED.at(None, clauses(f"there is no mux '{others[0]}'", suggest(others[0], [mux], "muxes")))
        )
    return mux


def _ls(arguments: argparse.Namespace) -> int:
    folder = find_robot(arguments.robot)
    found = [answer_of(folder, requests.LookAtMux(name)) for name in _names(folder)]
    if arguments.json:
        emit(json.dumps([to_data(item) for item in found]))
    elif not found:
        emit("this robot has no muxes")
    else:
        rows = [
            (state.name, state.mode, state.profile, ", ".join(each.name for each in state.inputs), state.why)
            for state in found
        ]
        emit(table([("mux", "mode", "profile", "inputs", ""), *rows]))
    return 0


def _why(arguments: argparse.Namespace) -> int:
    folder = find_robot(arguments.robot)
    state = answer_of(folder, requests.LookAtMux(_only_mux(arguments, folder)))
    emit(json.dumps(to_data(state)) if arguments.json else "\n".join(_account(state)))
    return 0


def _account(state: requests.MuxState) -> Iterator[str]:
    """Yield the lines that say who holds an output, who waits for what, and which locks are engaged."""
    until = f", for another {state.until - state.time:.2f} s unless it sends again" if state.until else ""
    yield f"{state.name}: {state.why}{until}"
    rows = [("input", "priority", "state", "last heard", "why")]
    for input_state in sorted(state.inputs, key=lambda each: -(each.priority or 0)):
        priority = "" if input_state.priority is None else str(input_state.priority)
        rows.append((input_state.name, priority, input_state.state, _heard(input_state), input_state.why))
    yield table(rows)
    for lock in state.locks:
        below = "all inputs" if lock.priority is None else f"inputs below {lock.priority}"
        yield f"lock {lock.name}: {f'{lock.why}, {below} are locked out' if lock.why else 'open'}"


def _heard(state: requests.MuxInputState) -> str:
    return "never" if state.silent_for is None else f"{state.silent_for:.2f} s ago"


def _watch(arguments: argparse.Namespace) -> int:
    folder = find_robot(arguments.robot)
    mux, after, shown = _only_mux(arguments, folder), 0, 0
    while True:
        changes = answer_of(folder, requests.ReadMuxChanges(mux, after))
        for change in changes if after else changes[-1:]:
            line = f"{change.time:9.2f} s  {change.text}"
            emit(json.dumps({"mux": mux, **to_data(change)}) if arguments.json else line)
            shown += 1
            if arguments.count is not None and shown >= arguments.count:
                return 0
        after = changes[-1].number if changes else after
        time.sleep(_LOOK)


def _order(arguments: argparse.Namespace, make: Callable[[str, list[str]], Command]) -> int:
    folder = find_robot(arguments.robot)
    show_answer(arguments, folder, answer_of(folder, make(*_chosen(arguments, folder))))
    return 0


def _one(mux: str, inputs: list[str]) -> str:
    """Return the only input that was named."""
    if len(inputs) != 1:
        raise NotDoneError(REFUSED.at(None, f"name one input of '{mux}'"))
    return inputs[0]


def _select(arguments: argparse.Namespace) -> int:
    return _order(arguments, lambda mux, inputs: requests.SelectMuxInput(mux, _one(mux, inputs)))


def _add(arguments: argparse.Namespace) -> int:
    def made(mux: str, inputs: list[str]) -> Command:
        return requests.AddMuxInput(mux, _one(mux, inputs), arguments.topic, arguments.priority, arguments.timeout)

    return _order(arguments, made)


def _delete(arguments: argparse.Namespace) -> int:
    return _order(arguments, lambda mux, inputs: requests.DeleteMuxInput(mux, _one(mux, inputs)))


def _lock(arguments: argparse.Namespace) -> int:
    return _order(arguments, lambda mux, inputs: requests.LockMuxInputs(mux, tuple(inputs), arguments.seconds))


def _unlock(arguments: argparse.Namespace) -> int:
    return _order(arguments, lambda mux, inputs: requests.UnlockMuxInputs(mux, tuple(inputs)))
