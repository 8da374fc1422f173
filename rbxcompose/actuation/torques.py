"""Torque that models of servos reach, and which share of it a limit of a joint leaves.

The numbers are the stall torques [Nm] of ROBOTIS's e-manual (emanual.robotis.com/docs/en/dxl), at the voltage that
stands beside them [V]: 12 V, or the one that the e-manual gives or recommends. At another voltage a servo has more or
less. For the P series the e-manual gives none. A limit is a share of the voltage at the motor, so a servo with less
torque is slower, too.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType

from rbxcompose.actuation.servo_models import ServoModel

STALL_TORQUES: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "AX-12": (1.5, 12.0),
        "AX-12W": (0.2, 12.0),
        "AX-18": (1.8, 12.0),
        "RX-24": (2.6, 12.0),
        "RX-28": (3.7, 18.5),
        "RX-64": (5.3, 18.5),
        "EX-106+": (10.9, 18.5),
        "MX-12W": (0.2, 12.0),
        "MX-28": (2.5, 12.0),
        "MX-64": (6.0, 12.0),
        "MX-106": (8.4, 12.0),
        "MX-28(2.0)": (2.5, 12.0),
        "MX-64(2.0)": (6.0, 12.0),
        "MX-106(2.0)": (8.4, 12.0),
        "XL-320": (0.39, 7.4),
        "XL330-M077": (0.215, 5.0),
        "XL330-M288": (0.52, 5.0),
        "XC330-M181": (0.60, 5.0),
        "XC330-M288": (0.93, 5.0),
        "XC330-T181": (0.80, 12.0),
        "XC330-T288": (1.00, 12.0),
        "XL430-W250": (1.5, 12.0),
        "XC430-W150": (1.6, 12.0),
        "XC430-W240": (1.9, 12.0),
        "XM430-W210": (3.0, 12.0),
        "XM430-W350": (4.1, 12.0),
        "XH430-W210": (2.5, 12.0),
        "XH430-W350": (3.4, 12.0),
        "XM540-W150": (7.3, 12.0),
        "XM540-W270": (10.6, 12.0),
        "XH540-W150": (7.1, 12.0),
        "XH540-W270": (9.9, 12.0),
    }
)
"""Torque [Nm] and voltage [V] by model."""


def stall_torque(model: ServoModel) -> float | None:
    """Return the torque at which a servo stalls [Nm], None if it is not known."""
    return STALL_TORQUES[model.name][0] if model.name in STALL_TORQUES else None


def joint_effort(models: Iterable[ServoModel], gear: float) -> float | None:
    """Return the most that servos together exert on their joint [Nm or N], None if that of one is not known.

    `gear` is how far a servo turns for each radian or metre of the joint [rad].
    """
    torques = [stall_torque(one) for one in models]
    known = [one for one in torques if one is not None]
    return abs(gear) * sum(known) if len(known) == len(torques) else None


def steepest(table: Sequence[tuple[float, float]]) -> float:
    """Return the gear of a table of angles of a servo [rad] and positions of its joint, where a servo is strongest."""
    return max(abs((b[0] - a[0]) / (b[1] - a[1])) for a, b in pairwise(sorted(table)))


def share_of(limit: float, effort: float) -> float:
    """Return the share of an effort that a limit leaves, both [Nm] or both [N]; the limit never adds any."""
    return max(0.0, min(1.0, limit / effort))
