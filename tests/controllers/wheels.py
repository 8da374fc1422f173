"""A base on two wheels on a bench, where its wheels really are, and what it tells of that."""

from __future__ import annotations

from typing import Any

from rbxcompose.base.geometry import Pose2, Transform3, Velocity2
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance

RADIUS, DISTANCE = 0.04, 0.26  # [m]
STEP = 0.01  # [s] between two looks at the wheels: a cycle, within which speeds do not change


def wheels(model: str = "XL430-W250", *, rate: float = 100.0, joint: Any = None, **config: Any) -> dict[str, Any]:
    """Return the configuration of a bus with a base; the right servo is mounted the other way round."""
    settings = {"type": "diff_drive", "left": "left", "right": "right", "wheel_distance": DISTANCE, **config}
    if "ticks_per_metre" not in config:
        settings["wheel_radius"] = RADIUS
    shape = {"mode": "velocity", "is_continuous": True, **(joint or {})}
    return {
        "twin": "servo",
        "rate": rate,
        "joints": {
            "left": {**shape, "servos": [{"id": 1, "model": model}]},
            "right": {**shape, "servos": [{"id": 2, "model": model, "invert": True}]},
        },
        "controllers": {"base": {"type": "diff_drive", "settings": settings}},
    }


class Rover:
    """A base, its true pose by the true ways of its wheels, and the poses that it tells."""

    def __init__(self, model: str = "XL430-W250", **config: Any) -> None:
        self.bench = Bench(instance("servos", "servo_bus", wheels(model, **config)), start=False)
        self.told: list[Odometry] = self.bench.collect("/odom", Odometry)
        self.statuses = self.bench.statuses("servos")
        self.commands = self.bench.bus.publisher("me", "/cmd_vel", Twist, Qos.COMMAND)
        self.driver: Any = self.bench.component("servos")
        self.true = Pose2()
        self.speeds: list[tuple[float, float]] = []  # of the wheels [m/s], at each step
        self._at = self._positions()
        self.advance(0.2)

    @property
    def servos(self) -> list[FakeServo]:
        """Return both servos as they are now."""
        return [self.driver.cycle.bus.line[id_] for id_ in (1, 2)]

    @property
    def torque(self) -> list[int]:
        """Return which wheels have torque."""
        return [servo.get("torque_enable") for servo in self.servos]

    @property
    def controller(self) -> Any:
        """Return the controller."""
        return self.driver.controllers.controllers["base"]

    @property
    def pose(self) -> Pose2:
        """Return the pose that it told last."""
        at, turn = self.told[-1].pose.pose.position, self.told[-1].pose.pose.orientation
        return Transform3((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w)).to_pose2()

    @property
    def is_still(self) -> bool:
        """Return whether no wheel turns."""
        return self.speeds[-1] == (0.0, 0.0)

    def command(self, linear: float, angular: float = 0.0) -> None:
        """Send one command."""
        self.commands(Twist(linear=Vector3(x=linear), angular=Vector3(z=angular)))

    def drive(self, linear: float, angular: float, seconds: float) -> None:
        """Send commands at 10 Hz."""
        for _ in range(round(seconds * 10)):
            self.command(linear, angular)
            self.advance(0.1)

    def advance(self, seconds: float) -> None:
        """Let time pass, and follow the wheels."""
        for _ in range(round(seconds / STEP)):
            self.bench.advance(STEP)
            before, self._at = self._at, self._positions()
            left, right = (self._way(new - old) for new, old in zip(self._at, before, strict=True))
            self.true = self.true.moved(Velocity2((left - right) / 2, (-right - left) / DISTANCE), 1.0)
            self.speeds.append((left / STEP, -right / STEP))

    def _positions(self) -> list[float]:
        return [servo.motor.position for servo in self.servos]

    def _way(self, ticks: float) -> float:
        return ((ticks + 2048) % 4096 - 2048) * self.servos[0].model.per_tick * RADIUS
