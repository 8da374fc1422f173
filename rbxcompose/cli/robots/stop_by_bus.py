"""Stop a robot whose supervisor does not answer, by a request to each of its processes over the bus."""

from __future__ import annotations

from rbxcompose.cli.bus.guest import Guest
from rbxcompose.cli.bus.place import place_of
from rbxcompose.cli.robots.lookup import NO_ANSWER, NotDoneError, known_state
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.process_group.stop_line import stop_key

_ANSWER = 1.0  # [s] for all processes together
_OTHERS = ("parent", "router")  # processes in which nothing moves


def stop_by_bus(folder: RobotFolder) -> str:
    """Stop the robot without its supervisor, and return which processes were reached and which were not.

    Raises:
        NotDoneError: if no process can be reached.
    """
    name, state = folder.path.name, known_state(folder)
    with Guest(place_of(folder)) as guest:
        told = sorted(answer.decode() for answer in guest.ask(stop_key(name), _ANSWER))
    missing = sorted({*(state.alive() if state else ())} - {*told, *_OTHERS})
    if not told:
        raise NotDoneError(NO_ANSWER.at(None, f"'{name}' does not answer, nor does any of its processes"))
    rest = f"; NOT stopped: {', '.join(missing)}" if missing else ""
    return f"the supervisor does not answer: stopped over the bus: {', '.join(told)}{rest}"
