"""The same base by the bytes of its servos, in real time."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.base.geometry import Pose2, Velocity2, wrap_angle
from rbxcompose.domains.bases.controllers.diff_drive import DiffDriveController
from rbxcompose.domains.servos.bus_config import ServoBusConfig, drives_of
from rbxcompose.domains.servos.dynamixel_bus import DynamixelBus
from rbxcompose.domains.servos.models import servo_models
from rbxcompose.domains.servos.servo_cycle import ServoCycle, prepare
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_line import FakeLine
from rbxcompose.domains.servos.twins.servo_twin import FakePort
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from tests.controllers.wheels import DISTANCE, RADIUS, wheels
from tests.soak import rare

PERIOD = 0.01
MOST = 60.0  # [s] of real time
SETTLED = 20  # cycles at rest, since a loaded machine loses replies of some


class Site:
    """A bus as a controller sees it, without messages."""

    stamp = 0
    refusal = ""
    start = Pose2()

    def __init__(self, joints: Any) -> None:
        self.joints, self.told, self.is_again = joints, list[str](), False

    @property
    def now(self) -> float:
        return time.monotonic()

    def item(self, actuator: str, name: str, *, is_read: bool, setup: Mapping[str, int]) -> Any:
        raise AssertionError(name)

    def action(self, port: str) -> Any:
        raise AssertionError(port)

    def goal(self, port: str) -> None:
        return None

    def send(self, port: str, message: Any) -> None:
        raise AssertionError(port)

    def keep(self, memory: object) -> None:
        """Nothing starts again here."""

    def warn(self, text: str) -> None:
        self.told.append(text)


def are_still(line: FakeLine) -> bool:
    """Return whether the motors stand: they take a while after the base has been told to."""
    return all(abs(line[id_].motor.velocity) < 1.0 for id_ in (1, 2))


@pytest.mark.parametrize("model", ["XL430-W250", *rare("MX-28")])
def test_a_base_drives_by_bytes_and_knows_where_it_is(model: str, tmp_path: Path) -> None:
    config = ServoBusConfig.model_validate(wheels(model, acceleration="2 m/s^2"))
    drives, known = drives_of(config), {id_: servo_models()[model] for id_ in (1, 2)}
    line = FakeLine([FakeServo(model, id_) for id_ in known], time.monotonic)
    line.servos[0].move_to(4000)  # so that it starts again at 0
    with FakePort(line, tmp_path / "servos") as port, DynamixelBus(str(port.path), known) as bus:
        list(prepare(bus, [drive.joint for drive in drives.values()], 0.0))
        cycle = ServoCycle(bus, drives)
        site: Any = Site(drives)
        setup: Any = config.controllers["base"].config
        base = DiffDriveController("base", setup, site)
        end, turned, still = time.monotonic() + MOST, False, 0
        while time.monotonic() < end and still < SETTLED:
            turned |= base.odometry.pose.heading > math.pi / 4
            if not turned:
                base.received("commands", Twist(linear=Vector3(x=0.2), angular=Vector3(z=0.8)))
            else:
                base.halt(0.0, "")
            cycle.run(time.monotonic(), PERIOD, [base])
            still = still + 1 if turned and base.drive.at_rest and are_still(line) else 0
        assert time.monotonic() < end
        pose, tick = base.odometry.pose, known[1].per_tick
        told = [drives[name].measured.position * RADIUS for name in ("left", "right")]
        true = [(line[1].motor.position - 2048) * tick * RADIUS, (2048 - line[2].motor.position) * tick * RADIUS]
    assert site.told == []
    turn = math.tau * RADIUS  # a servo of protocol 1.0 starts again at 0
    left, right = (number + turn * round((other - number) / turn) for number, other in zip(true, told, strict=True))
    left -= (4000 - 2048) * tick * RADIUS
    true_pose = Pose2().moved(Velocity2((left + right) / 2, (right - left) / DISTANCE), 1.0)
    assert abs(wrap_angle(pose.heading - true_pose.heading)) < 1e-3
    assert pose.distance(true_pose) < 3e-2  # `true_pose` is on one arc, which a loaded machine leaves
    assert pose.heading > math.pi / 4
