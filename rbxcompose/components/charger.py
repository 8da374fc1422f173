"""Charging at the dock."""

from __future__ import annotations

from pydantic import Field

from rbxcompose.msgs.rbxcompose_msgs import Recharge, SetBatteryLevel
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.sdk import (
    Calls,
    Capability,
    Charges,
    Component,
    Config,
    In,
    Length,
    Looks,
    PlaceName,
    Pose2,
    Reply,
    ServesAction,
    Setting,
    component,
)

FULL = 100.0  # [%]
NEARLY_FULL = 99.0  # [%] from here on a level counts as full: the battery drains while it is told


class ChargerConfig(Config):
    """Where the dock is."""

    dock: PlaceName
    """The place where the robot can be charged."""
    reach: Length = Field(0.2, gt=0)
    """How near to the dock the robot must be."""


@component("charger")
class Charger(Component[ChargerConfig]):
    """Charges the battery of a robot that stands at the dock; away from it, the goal is refused.

    Example:
        charger: {type: charger, dock: dock, reach: 20 cm}
    """

    rate = 10.0
    pose = Looks(source="base_footprint", target="map")
    battery_level = In(Float32, "battery_level", unit="%")
    set_battery_level = Calls(SetBatteryLevel, "set_battery_level")
    recharge = ServesAction(Recharge, "recharge", claims="base")

    @classmethod
    def capabilities(cls, config: ChargerConfig) -> tuple[Capability, ...]:
        """Return that it charges at the dock until the battery is nearly full."""
        dock, reach = Setting(config.dock, "dock"), Setting(config.reach, "reach")
        return (Charges("recharge", dock, reach, until=Setting(NEARLY_FULL / FULL)),)

    def configure(self) -> None:
        """Nothing is being charged."""
        self.charging: object = None  # the goal for which the level was set
        self.is_full = False
        self.error = ""

    def accept_recharge(self, goal: Recharge.Goal) -> str:
        """Refuse to charge away from the dock."""
        dock, pose = self.config.dock, self.pose.now()
        if pose is None:
            return "nobody tells where the robot is"
        away = pose.distance(Pose2(dock.x, dock.y))
        if away > self.config.reach:
            return f"the robot is {away:.2f} m away from '{dock.name}'"
        return ""

    def on_battery_level(self, message: Float32) -> None:
        """See whether the battery is full."""
        self.is_full = message.data >= NEARLY_FULL

    def step(self, dt: float) -> None:
        """Carry the goal on: set the level, then wait until a full one was published."""
        goal = self.recharge.current
        if goal is None:
            return
        if goal.cancel_requested:
            goal.canceled()
        elif goal is not self.charging:
            self.charging, self.is_full, self.error = goal, False, ""
            self.set_battery_level(SetBatteryLevel.Request(value=FULL), self.answered)
        elif self.error:
            goal.aborted(self.error)
        elif self.is_full and self.battery_level.value is not None:
            goal.succeeded(Recharge.Result(level=self.battery_level.value.data))

    def answered(self, reply: Reply[SetBatteryLevel.Response]) -> None:
        """Take the battery's answer."""
        self.error = reply.error
