"""Changing a servo's id, which must not happen to two servos at once."""

from __future__ import annotations

from rbxcompose.actuation.dynamixel_bus import IDS, DynamixelBus
from rbxcompose.actuation.servo_findings import ID_TAKEN, REFUSED, SILENT, UNKNOWN_MODEL
from rbxcompose.findings import Finding

_PROTOCOLS = (1, 2)
_ALONE = "disconnect all servos but the one that is meant"


def change_id(bus: DynamixelBus, old: int, new: int) -> Finding | None:
    """Give the only servo at `old` the free id `new`, with torque off; return what is wrong, None if it is done.

    Raises:
        ValueError: if an id is not 0 to 252.
        PortError: if the port has gone.
    """
    if old not in IDS or new not in IDS:
        raise ValueError("ids are 0 to 252")
    counted = sum(bus.count(old, protocol) for protocol in _PROTOCOLS)
    if not counted:
        return SILENT.at(None, f"no servo answers at id {old}", help="'rbxcompose servo scan' shows who does")
    if counted > 1:
        return ID_TAKEN.at(None, f"more than one servo answers at id {old}", help=_ALONE)
    if new != old and any(bus.count(new, protocol) for protocol in _PROTOCOLS):
        return ID_TAKEN.at(None, f"a servo has the id {new} already", help=_ALONE)
    return _changed(bus, old, new)


def _changed(bus: DynamixelBus, old: int, new: int) -> Finding | None:
    found = bus.ping(old)
    if found is None or found.model is None:
        return UNKNOWN_MODEL.at(None, f"the servo at id {old} is of no known model", help="use its maker's tool")
    bus.servos[old] = found.model
    bus.write({old: {"torque_enable": 0}}, is_confirmed=True)
    bus.write({old: {"id": new}}, is_confirmed=True)  # some confirm under the new id, so only a ping tells
    del bus.servos[old]
    if bus.ping(new, found.protocol) is None:
        locked = "; its memory may be locked until it is switched off and on" if found.protocol == 1 else ""
        return REFUSED.at(None, f"the servo at id {old} has not taken the id {new}{locked}")
    return None
