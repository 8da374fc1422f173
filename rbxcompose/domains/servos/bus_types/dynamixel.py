"""Dynamixel servos, of both protocols on one line."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from rbxcompose.domains.servos.bus import DYNAMIXEL, ServoBus, bus_type_declared
from rbxcompose.domains.servos.models import ServoModel, servo_models


@bus_type_declared(DYNAMIXEL, servo_models, package="dynamixel_sdk", extra="servos")
def open_dynamixel(
    path: str, servos: Mapping[int, ServoModel], *, baud: int, clock: Callable[[], float], is_fast: bool
) -> ServoBus:
    """Open the port."""
    from rbxcompose.domains.servos.dynamixel_bus import DynamixelBus  # its SDK is an extra

    return DynamixelBus(path, servos, baud=baud, clock=clock, is_fast=is_fast)
