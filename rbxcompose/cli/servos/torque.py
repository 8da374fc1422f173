"""`servo relax`, `disable` and `enable`: torque of servos on a bare bus.

A relaxed servo may get torque by its next goal: the firmware of protocol 1.0 switches it on when a goal position is
written. A disabled one ignores goals, too, because its torque limit in RAM is 0. In protocol 2.0 no goal switches
torque on, so there `disable` has nothing to add.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence

from rbxcompose.actuation.dynamixel_bus import DynamixelBus
from rbxcompose.actuation.servo_findings import SILENT
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.cli.servos.reach import bus_at, known, protocols, written

_TORQUE, _LIMIT, _MOST = "torque_enable", "torque_limit", "max_torque"


def relax(arguments: argparse.Namespace) -> int:
    """Switch torque off."""
    return _with_servos(arguments, lambda bus, ids: written(bus, {one: {_TORQUE: 0} for one in ids}, arguments))


def disable(arguments: argparse.Namespace) -> int:
    """Switch torque off, so that no goal switches it on again."""
    return _with_servos(arguments, lambda bus, ids: _disabled(bus, ids, arguments))


def enable(arguments: argparse.Namespace) -> int:
    """Switch torque on, where servos are."""
    return _with_servos(arguments, lambda bus, ids: _enabled(bus, ids, arguments))


def _with_servos(arguments: argparse.Namespace, do: Callable[[DynamixelBus, Sequence[int]], int]) -> int:
    with bus_at(arguments, arguments.baud[0]) as bus:
        ids = arguments.ids
        if arguments.all:
            ids = [one.id for one in bus.scan(range(arguments.last + 1), protocols(arguments)) if one.model]
        if not ids:
            return refuse(SILENT.at(None, "no servo is named and none answers", help="name ids, or use --all"))
        for one in ids:
            known(bus, one, arguments)
        return do(bus, ids)


def _disabled(bus: DynamixelBus, ids: Sequence[int], arguments: argparse.Namespace) -> int:
    limited = [one for one in ids if bus.servos[one].family.enables_at_goal]
    values = {one: {_TORQUE: 0, _LIMIT: 0} if one in limited else {_TORQUE: 0} for one in ids}
    code = written(bus, values, arguments, limited=limited)
    if not code and not arguments.json:
        for one in ids:
            words = (
                "ignores goals until 'servo enable', or until it is switched off and on"
                if one in limited
                else "is relaxed: no goal switches its torque on, so there is nothing more to disable"
            )
            tell(f"the {bus.servos[one].name} at id {one} {words}")
    return code


def _enabled(bus: DynamixelBus, ids: Sequence[int], arguments: argparse.Namespace) -> int:
    _hold(bus, ids)
    values = {one: {_TORQUE: 1, **_undone(bus, one)} for one in ids}
    return written(bus, values, arguments)


def _hold(bus: DynamixelBus, ids: Sequence[int]) -> None:
    """Let the goals be the present positions, so that torque moves nothing."""
    now = bus.read(ids, ["present_position"])
    bus.write({one: {"goal_position": reading.values["present_position"]} for one, reading in now.items()})


def _undone(bus: DynamixelBus, id: int) -> dict[str, int]:
    """Return the torque limit that replaces 0, which `disable` or an overload has left."""
    if _MOST not in bus.servos[id].items:
        return {}
    reading = bus.read([id], [_LIMIT, _MOST]).get(id)
    return {_LIMIT: reading.values[_MOST]} if reading and reading.values[_LIMIT] == 0 else {}
