"""List, switch, slow down and hold the controllers that lead the joints of a running robot."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence

from rbxcompose.base.findings import clauses, suggest
from rbxcompose.base.requests import to_data
from rbxcompose.base.units import RATIO, UnitError, to_si
from rbxcompose.commands.console import NotDoneError, emit, table
from rbxcompose.commands.lookup import REFUSED, add_asking_options, answer_of, find_robot, known_state, show_answer
from rbxcompose.commands.options import Subcommand, add_actions, argument, run_action
from rbxcompose.domains.servos import controller_manager
from rbxcompose.runtime.folder import RobotFolder

GROUP = "drive"
ON_SYSTEM = controller_manager.BUS
FOR_ALL = ("ls",)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    apart = "No joint may be led by two controllers, so name those that give way with --off."
    slowed = (
        "The goal on its way stays on its path, and is slowed down, too. 0 % holds it where it is, 100 % lets it go on."
        " Motions led by hand keep their speed."
    )
    on = argument("on", metavar="NAME", nargs="*", help="a controller that becomes active")
    off = argument("--off", metavar="NAME", action="append", default=[], help="one that becomes inactive")
    name = argument("name", metavar="NAME", help="the controller")
    share = argument("share", metavar="SHARE", help="from 0 %% to 100 %%")
    actions = (
        Subcommand("ls", "list controllers, whether they are active, and their joints", _ls),
        Subcommand("switch", "switch controllers on and off, all at once or not at all", _switch, (on, off), apart),
        Subcommand(
            "speed", "let a controller follow its goals at a share of their speed", _speed, (name, share), slowed
        ),
    )
    add_actions(parser, actions, add_asking_options)


run = run_action


def _listed(folder: RobotFolder) -> Iterator[tuple[str, controller_manager.ControllerState]]:
    """Yield the controllers of a robot, each with its bus."""
    state = known_state(folder)
    for component in state.components if state else ():
        if component.type == controller_manager.BUS:
            for one in answer_of(folder, controller_manager.ListControllers(component.name)):
                yield component.name, one


def _ls(arguments: argparse.Namespace) -> int:
    found = list(_listed(find_robot(arguments.robot)))
    if arguments.json:
        emit(json.dumps([{"bus": bus, **to_data(state)} for bus, state in found]))
    elif not found:
        emit("this robot has no controllers")
    else:
        rows = [(item.name, item.type, _state(item), bus, ", ".join(item.joints), item.note) for bus, item in found]
        emit(table([("name", "type", "state", "bus", "joints", ""), *rows]))
    return 0


def _state(state: controller_manager.ControllerState) -> str:
    return "active" if state.is_active else "inactive"


def _buses(folder: RobotFolder, names: Sequence[str]) -> list[str]:
    """Return the bus of each of these controllers."""
    buses = {state.name: bus for bus, state in _listed(folder)}
    for name in names:
        if name not in buses:
            message = clauses(f"there is no controller '{name}'", suggest(name, buses, "controllers"))
            raise NotDoneError(REFUSED.at(None, message))
    return [buses[name] for name in names]


def _switch(arguments: argparse.Namespace) -> int:
    folder, names = find_robot(arguments.robot), [*arguments.on, *arguments.off]
    if not names:
        raise NotDoneError(REFUSED.at(None, "name a controller to switch on, or one to switch off with --off"))
    buses = _buses(folder, names)
    if len(set(buses)) > 1:
        raise NotDoneError(REFUSED.at(None, "these controllers are on different buses: switch those of one at a time"))
    request = controller_manager.SwitchControllers(buses[0], tuple(arguments.on), tuple(arguments.off))
    show_answer(arguments, folder, answer_of(folder, request))
    return 0


def _speed(arguments: argparse.Namespace) -> int:
    folder = find_robot(arguments.robot)
    [bus] = _buses(folder, [arguments.name])
    try:
        share = to_si(arguments.share, RATIO)
    except UnitError as error:
        raise NotDoneError(REFUSED.at(None, f"'{arguments.share}' {error}", help="write '30 %'")) from error
    show_answer(arguments, folder, answer_of(folder, controller_manager.ScaleMotion(bus, arguments.name, share)))
    return 0
