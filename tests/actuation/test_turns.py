"""Whose turn it is: with any number of servos, each one's temperature, faults and torque limit are read in time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import pytest

from rbxcompose.domains.servos.bus import SELDOM, ServoReading
from rbxcompose.domains.servos.joint_drive import JointServo, PositionDrive, ServoJoint
from rbxcompose.domains.servos.joint_states import JointPolicy
from rbxcompose.domains.servos.limits import MotionLimits
from rbxcompose.domains.servos.models import servo_models
from rbxcompose.domains.servos.servo_cycle import TORQUE, TORQUE_LIMIT, ServoCycle
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_twin import TwinBus
from tests.soak import rare

CYCLE = 0.01  # [s]
MODEL = servo_models()["XL430-W250"]


class CountingBus(TwinBus):
    """Servos that count which of their items are read."""

    def __init__(self, ids: Sequence[int]) -> None:
        """Take the ids of the servos."""
        super().__init__([FakeServo(MODEL.name, id_) for id_ in ids], lambda: 0.0)
        self.read_items: Counter[tuple[int, str]] = Counter()

    def read(self, ids: Sequence[int], items: Sequence[str], *, budget: float | None = None) -> dict[int, ServoReading]:
        """Return the items, and count."""
        self.read_items.update((id_, item) for id_ in ids for item in items)
        return super().read(ids, items, budget=budget)


def drives(ids: Sequence[int]) -> Mapping[str, PositionDrive]:
    joints = {f"joint_{id_}": (JointServo(id_, MODEL, MODEL.family.centre),) for id_ in ids}
    limits, policy = MotionLimits(-1.0, 1.0, 1.0), JointPolicy(CYCLE)
    return {name: PositionDrive(ServoJoint(name, servos, limits), policy) for name, servos in joints.items()}


@pytest.mark.parametrize("count", [1, 10, 11, *rare(2, 9, 20, 30, 40)])
def test_no_number_of_servos_keeps_one_of_them_from_its_turn(count: int) -> None:
    ids = range(1, count + 1)
    bus = CountingBus(ids)
    cycle = ServoCycle(bus, drives(ids))
    assert list(cycle.limit(cycle.drives.values())) == []
    bus.read_items.clear()
    for number in range(2 * SELDOM * count):
        cycle.run(number * CYCLE, CYCLE)
    for id_ in ids:
        assert bus.read_items[id_, "present_temperature"] == bus.read_items[id_, "hardware_error"] == 2 * (SELDOM - 1)
        assert bus.read_items[id_, TORQUE] == bus.read_items[id_, TORQUE_LIMIT] == 1
