"""Charging at the dock."""

from __future__ import annotations

from functools import partial

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.msgs.rbxcompose_msgs import Recharge, SetBatteryLevel
from rbxcompose.msgs.std_msgs import Float32

FULL = 100.0  # [%]
NEARLY_FULL = 99.0  # [%] a level from here on counts as full: the battery drains even while it reports
PATIENCE = 10.0  # [s] for the battery to report its level


class ChargerConfig(sdk.Config):
    """Where the dock is."""

    dock: sdk.PlaceName
    """The place where the robot can be charged."""
    reach: sdk.Length = Field(0.2, gt=0)
    """How near to the dock the robot must be."""


@sdk.component("charger")
class Charger(sdk.Component[ChargerConfig]):
    """Charges the battery of a robot at the dock; away from the dock, the goal is refused.

    Example:
        charger: {type: charger, dock: dock, reach: 20 cm}
    """

    rate = 10.0
    steps_for_goals = True
    pose = sdk.Looks(source="base_footprint", target="map")
    battery_level = sdk.In(Float32, "battery_level", unit="%")
    set_battery_level = sdk.Calls(SetBatteryLevel, "set_battery_level")
    recharge = sdk.ServesAction(Recharge, "recharge", claims="base")

    @classmethod
    def capabilities(cls, config: ChargerConfig) -> tuple[sdk.Capability, ...]:
        """Declare that it charges at the dock until the battery is nearly full."""
        dock, reach = sdk.Setting(config.dock, "dock"), sdk.Setting(config.reach, "reach")
        return (sdk.Charges("recharge", dock, reach, until=sdk.Setting(NEARLY_FULL / FULL)),)

    def configure(self) -> None:
        """Start without a goal."""
        self.charging: object = None  # the goal for which the level was set
        self.deadline = 0.0  # [s] of robot time
        self.is_set = False  # the battery has confirmed that it is set to full
        self.is_full = False  # it has also reported a level since, however much has drained meanwhile
        self.error = ""

    def accept_recharge(self, goal: Recharge.Goal) -> str:
        """Refuse a goal away from the dock."""
        dock, pose = self.config.dock, self.pose.now()
        if pose is None:
            return "the robot's position is unknown"
        away = pose.distance(sdk.Pose2(dock.x, dock.y))
        if away > self.config.reach:
            return f"the robot is {away:.2f} m away from '{dock.name}'"
        return ""

    def on_battery_level(self, message: Float32) -> None:
        """Note whether the battery is full, or has been since the goal came."""
        self.is_full = self.is_full or self.is_set or message.data >= NEARLY_FULL

    def step(self, dt: float) -> None:
        """Continue the goal: set the level, then wait until the battery has reported it."""
        goal = self.recharge.current
        if goal is None:
            return
        if goal.cancel_requested:
            goal.canceled()
        elif goal is not self.charging:
            self.charging, self.deadline = goal, self.now + PATIENCE
            self.is_set, self.is_full, self.error = False, False, ""
            self.set_battery_level(SetBatteryLevel.Request(value=FULL), partial(self.answered, goal))
        elif self.error:
            goal.aborted(self.error)
        elif self.is_full and self.battery_level.value is not None:
            goal.succeeded(Recharge.Result(level=self.battery_level.value.data))
        elif self.now >= self.deadline:
            goal.aborted(f"the battery reported no level for {PATIENCE:.0f} s")

    def answered(self, goal: object, reply: sdk.Reply[SetBatteryLevel.Response]) -> None:
        """Handle the battery's answer, unless it concerns a goal that has ended."""
        if goal is self.charging:
            self.error, self.is_set = reply.error, not reply.error
