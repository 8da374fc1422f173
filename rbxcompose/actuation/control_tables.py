"""Control tables of the Dynamixel families, as ROBOTIS publishes them in its e-manual.

A row is `NAME ADDRESS SIZE UNIT CODING`: size in bytes, unit as in `UNITS` or `-`, coding as in `Coding`. A name means
the same in all tables: `goal_speed` limits the speed towards a goal position (0: no limit), `goal_velocity` is the
speed of a wheel, `present_load` is a current where the unit says so. `torque_limit` and `max_torque` are shares of the
supply that the motor gets at most; in protocol 2.0 the e-manual calls them Goal PWM, which is a limit in all modes but
that of PWM, and PWM Limit. `velocity_limit` is the fastest `goal_velocity` that a servo takes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from rbxcompose.actuation.control_items import Coding, ControlItem

_RPM = 2 * math.pi / 60  # [rad/s]
_REV_PER_MIN2 = 2 * math.pi / 3600  # [rad/s^2]
TICK = "tick"  # its size depends on the model

UNITS: Mapping[str, tuple[float, str]] = MappingProxyType(
    {
        "-": (1.0, ""),
        "0.1V": (0.1, "V"),
        "degC": (1.0, "degC"),
        "2us": (2e-6, "s"),
        "20ms": (0.02, "s"),
        "0.1%": (0.001, "1"),
        "1/1023": (1 / 1023, "1"),
        "1/885": (1 / 885, "1"),
        "1/2009": (1 / 2009, "1"),
        "1mA": (0.001, "A"),
        "2.69mA": (0.00269, "A"),
        "0.111rpm": (0.111 * _RPM, "rad/s"),
        "0.114rpm": (0.114 * _RPM, "rad/s"),
        "0.229rpm": (0.229 * _RPM, "rad/s"),
        "0.01rpm": (0.01 * _RPM, "rad/s"),
        "8.583deg/s2": (math.radians(8.583), "rad/s^2"),
        "214.577rev/min2": (214.577 * _REV_PER_MIN2, "rad/s^2"),
        "1rev/min2": (_REV_PER_MIN2, "rad/s^2"),
    }
)
"""SI value of one raw step, and the SI unit."""

_ONE = """
model_number 0 2 - u
firmware 2 1 - u
id 3 1 - u
baud 4 1 - u
return_delay 5 1 2us u
min_position 6 2 tick u
max_position 8 2 tick u
temperature_limit 11 1 degC u
max_torque 14 2 1/1023 u
status_return_level 16 1 - u
shutdown 18 1 - u
torque_enable 24 1 - u
led 25 1 - u
goal_position 30 2 tick u
goal_speed 32 2 SPEED u
goal_velocity 32 2 SPEED d
torque_limit 34 2 1/1023 u
present_position 36 2 tick u
present_speed 38 2 SPEED d
present_load 40 2 0.1% d
present_voltage 42 1 0.1V u
present_temperature 43 1 degC u
moving 46 1 - u
lock 47 1 - u
"""
_ONE_FAST = _ONE.replace("SPEED", "0.111rpm")
_ONE_MX = _ONE.replace("SPEED", "0.114rpm") + "profile_acceleration 73 1 8.583deg/s2 u\n"
_XL320 = """
model_number 0 2 - u
firmware 2 1 - u
id 3 1 - u
baud 4 1 - u
return_delay 5 1 2us u
min_position 6 2 tick u
max_position 8 2 tick u
operating_mode 11 1 - u
temperature_limit 12 1 degC u
max_torque 15 2 1/1023 u
status_return_level 17 1 - u
shutdown 18 1 - u
torque_enable 24 1 - u
led 25 1 - u
goal_position 30 2 tick u
goal_speed 32 2 0.111rpm u
goal_velocity 32 2 0.111rpm d
torque_limit 35 2 1/1023 u
present_position 37 2 tick u
present_speed 39 2 0.111rpm d
present_load 41 2 0.1% d
present_voltage 45 1 0.1V u
present_temperature 46 1 degC u
moving 49 1 - u
hardware_error 50 1 - u
"""
_TWO_LOW = """
model_number 0 2 - u
firmware 6 1 - u
id 7 1 - u
baud 8 1 - u
return_delay 9 1 2us u
operating_mode 11 1 - u
homing_offset 20 4 tick s
temperature_limit 31 1 degC u
max_torque 36 2 PWM u
velocity_limit 44 4 VELOCITY u
max_position 48 4 tick u
min_position 52 4 tick u
shutdown 63 1 - u
"""
_X = (
    _TWO_LOW.replace("PWM", "1/885").replace("VELOCITY", "0.229rpm")
    + """
torque_enable 64 1 - u
led 65 1 - u
status_return_level 68 1 - u
hardware_error 70 1 - u
bus_watchdog 98 1 20ms s
torque_limit 100 2 1/885 s
goal_velocity 104 4 0.229rpm s
profile_acceleration 108 4 214.577rev/min2 u
goal_speed 112 4 0.229rpm u
goal_position 116 4 tick s
moving 122 1 - u
present_load 126 2 LOAD s
present_speed 128 4 0.229rpm s
present_position 132 4 tick s
present_voltage 144 2 0.1V u
present_temperature 146 1 degC u
"""
)
_X_CURRENT = _X + "goal_current 102 2 LOAD s\n"
_PORTS = """
external_port_mode_1 56 1 - u
external_port_mode_2 57 1 - u
external_port_mode_3 58 1 - u
external_port_data_1 152 2 - u
external_port_data_2 154 2 - u
external_port_data_3 156 2 - u
"""
_P = (
    _TWO_LOW.replace(" 4 tick u", " 4 tick s").replace("PWM", "1/2009").replace("VELOCITY", "0.01rpm")
    + """
torque_enable 512 1 - u
led 513 1 - u
status_return_level 516 1 - u
hardware_error 518 1 - u
bus_watchdog 546 1 20ms s
torque_limit 548 2 1/2009 s
goal_current 550 2 1mA s
goal_velocity 552 4 0.01rpm s
profile_acceleration 556 4 1rev/min2 u
goal_speed 560 4 0.01rpm u
goal_position 564 4 tick s
moving 570 1 - u
present_load 574 2 1mA s
present_speed 576 4 0.01rpm s
present_position 580 4 tick s
present_voltage 592 2 0.1V u
present_temperature 594 1 degC u
"""
)
TABLES: Mapping[str, str] = MappingProxyType(
    {
        "AX": _ONE_FAST,
        "RX": _ONE_FAST,
        "EX": _ONE_FAST + "present_current 56 2 - u\n",
        "MX 1.0": _ONE_MX,
        "XL-320": _XL320,
        "X load": _X.replace("LOAD", "0.1%"),
        "X 1 mA": _X_CURRENT.replace("LOAD", "1mA"),
        "X 2.69 mA": _X_CURRENT.replace("LOAD", "2.69mA"),
        "X540": _X_CURRENT.replace("LOAD", "2.69mA") + _PORTS,
        "P": _P,
    }
)
"""The rows of each family."""
OUTPUTS = ("led", *(f"external_port_data_{number}" for number in (1, 2, 3)))
"""Items that may be switched without moving anything."""


def items_of(table: str, per_tick: float, centre: int) -> Mapping[str, ControlItem]:
    """Return the items of a table by name, for a model with this angle per tick [rad] and this tick at 0 rad."""
    rows = (line.split() for line in TABLES[table].splitlines() if line)
    return MappingProxyType({row[0]: _item(row, per_tick, centre) for row in rows})


def _item(row: list[str], per_tick: float, centre: int) -> ControlItem:
    name, address, size, unit, coding = row
    per_raw, si = (per_tick, "rad") if unit == TICK else UNITS[unit]
    middle = centre if unit == TICK and name != "homing_offset" else 0
    return ControlItem(name, int(address), int(size), Coding(coding), per_raw, si, middle)
