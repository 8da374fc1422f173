"""Everything that the author of a plug-in imports."""

from rbxcompose.config import (
    Acceleration,
    Angle,
    AngularAcceleration,
    AngularSpeed,
    Config,
    Frequency,
    JointName,
    Length,
    LinkName,
    Live,
    Name,
    Place,
    PlaceName,
    Ratio,
    Secret,
    Speed,
    Time,
)
from rbxcompose.geometry import Pose2
from rbxcompose.levels import Level
from rbxcompose.msgs.entries import ArrayEntries
from rbxcompose.qos import Qos
from rbxcompose.requests import Command, Query, Refused, answers
from rbxcompose.robot_events import MissionOver, MissionWaits
from rbxcompose.sdk.bound import Ended, Outcome, Reply, SentGoal, ServedGoal
from rbxcompose.sdk.capabilities import (
    Capability,
    Charges,
    CommandsMotion,
    Drains,
    Drives,
    Forwards,
    Navigates,
    RunsMissions,
    Setting,
    WritesFrame,
)
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.ports import Calls, CallsAction, In, Looks, Out, Port, Serves, ServesAction, ServesTopic
from rbxcompose.sdk.registry import component
from rbxcompose.sdk.skills import Activity, skill

__all__ = [
    "Acceleration",
    "Activity",
    "Angle",
    "AngularAcceleration",
    "AngularSpeed",
    "ArrayEntries",
    "Calls",
    "CallsAction",
    "Capability",
    "Charges",
    "Command",
    "CommandsMotion",
    "Component",
    "Config",
    "Drains",
    "Drives",
    "Ended",
    "Forwards",
    "Frequency",
    "In",
    "JointName",
    "Length",
    "Level",
    "LinkName",
    "Live",
    "Looks",
    "MissionOver",
    "MissionWaits",
    "Name",
    "Navigates",
    "Out",
    "Outcome",
    "Place",
    "PlaceName",
    "Port",
    "Pose2",
    "Qos",
    "Query",
    "Ratio",
    "Refused",
    "Reply",
    "RunsMissions",
    "Secret",
    "SentGoal",
    "ServedGoal",
    "Serves",
    "ServesAction",
    "ServesTopic",
    "Setting",
    "Speed",
    "Time",
    "WritesFrame",
    "answers",
    "component",
    "skill",
]
