"""What is read of servos in each cycle."""

from __future__ import annotations

from rbxcompose.actuation.servo_models import ServoModel

FAST = ("present_position", "present_speed", "present_load")
"""Of all servos."""
_SLOW = ("present_temperature", "present_voltage")
_RARE = ("hardware_error", "bus_watchdog")  # of models that have them


SELDOM = 10
"""In one of so many cycles, the torque limit of a servo is read instead."""


def slow_items(model: ServoModel) -> list[str]:
    """Return what is read of one servo, another one in each cycle."""
    return [*_SLOW, *(name for name in _RARE if name in model.items)]
