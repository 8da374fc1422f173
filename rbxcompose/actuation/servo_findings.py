"""What can be wrong with servos on a bus, for people."""

from __future__ import annotations

from rbxcompose.findings import Severity, kind

NOT_INSTALLED = kind(
    "RBX2207",
    """Servos need a package that is not installed

Robots without servos do without it; it is an extra: `pip install 'rbxcompose[servos]'`.

Bad: `pip install rbxcompose`
Good: `pip install 'rbxcompose[servos]'`
""",
)
SILENT = kind(
    "RBX2208",
    """No servo answers

It has no power, another id, another baud rate or the other protocol, or the data line is not connected. AX servos are
sold with id 1 at 1000000 bit/s, MX and X servos with id 1 at 57600 bit/s.

Bad: `rbxcompose servo ping 1 --port /dev/ttyUSB0`, while the servo listens at 57600 bit/s.
Good: `rbxcompose servo scan --port /dev/ttyUSB0 --baud 57600 115200 1000000 2000000`
""",
)
ID_TAKEN = kind(
    "RBX2209",
    """More than one servo has this id

Servos with the same id answer at the same time and spoil each other's replies. All of them take the new id, too.

Bad: two new servos, both with id 1, on one cable.
Good: connect one servo after the other, and give each its own id: `rbxcompose servo set-id 1 2 --port /dev/ttyUSB0`
""",
)
NO_ITEM = kind(
    "RBX2210",
    """The servo has no such item

Items are values in the servo's memory; `rbxcompose servo info` lists those of a servo. A value is a raw number, or a
quantity with its unit.

Bad: `rbxcompose servo write 1 goal_positon=512 --port /dev/ttyUSB0`
Good: `rbxcompose servo write 1 goal_position='30 deg' --port /dev/ttyUSB0`
""",
)
REFUSED = kind(
    "RBX2211",
    """The servo has not taken a value

It is beyond the servo's limits, the item can only be read, or it is locked: torque must be off before ids, baud rates
and limits change. A servo that has shut down must be rebooted before it takes torque again.

Bad: `rbxcompose servo write 1 max_position=3000 --port /dev/ttyUSB0` while torque is on.
Good: `rbxcompose servo relax 1 --port /dev/ttyUSB0` first.
""",
)
UNKNOWN_MODEL = kind(
    "RBX2212",
    """The model of a servo is not known

It answers, but its model number is in no control table of rbxcompose, so the places of its values are not known.

Bad: a gripper or a sensor of another make on the bus.
Good: a model that `rbxcompose servo scan` names.
""",
)
OTHER_RATE = kind(
    "RBX2250",
    """A servo has another rate than its bus

A bus has one rate, so a robot has no use for a servo that listens at another one. `rbxcompose servo new-robot` takes
the rate that most servos have, and leaves the others out. The item `baud` has the rate as a code, and can be written
while torque is off.

Bad: five servos at 1000000 bit/s, and one at 57600 bit/s as it was sold.
Good: `rbxcompose servo write 6 baud=3 --port /dev/ttyUSB0 --baud 57600`, for an X servo.
""",
    Severity.WARNING,
)
