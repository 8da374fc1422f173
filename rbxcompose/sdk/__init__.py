"""Everything that the author of a plug-in imports."""

from rbxcompose.base.config import (
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
    Replaceable,
    Secret,
    Speed,
    Time,
)
from rbxcompose.base.geometry import Pose2
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Command, OutsideError, Query, Refused, answers
from rbxcompose.msgs.fields import ArrayEntries, NumberRange
from rbxcompose.sdk.bound import Ended, Later, Outcome, Reply, SentGoal, ServedGoal
from rbxcompose.sdk.capabilities import (
    BoundsGoals,
    Capability,
    Charges,
    CommandsMotion,
    Drains,
    Drives,
    Forwards,
    Navigates,
    NeedsExtra,
    OpensPort,
    PutsThings,
    RollsOn,
    RunsMissions,
    SeesEdges,
    SensesPhysics,
    Setting,
    Warns,
    WritesFrame,
)
from rbxcompose.sdk.component import Component, ComponentNoted, MissionOver, MissionWaits, RobotHeld
from rbxcompose.sdk.ports import (
    Calls,
    CallsAction,
    In,
    Looks,
    MessageLimits,
    MessageName,
    Out,
    Port,
    Qos,
    Serves,
    ServesAction,
    ServesTopic,
)
from rbxcompose.sdk.registry import Activity, component, skill
from rbxcompose.sdk.updater import CompositeTask, FrequencyTask, StampTask, TaskStatus, heartbeat

__all__ = [
    "Acceleration", "Activity", "Angle", "AngularAcceleration", "AngularSpeed", "ArrayEntries", "BoundsGoals",
    "Calls", "CallsAction", "Capability", "Charges", "Command", "CommandsMotion", "Component", "ComponentNoted",
    "CompositeTask", "Config", "Drains", "Drives", "Ended", "Forwards", "Frequency", "FrequencyTask", "In",
    "JointName", "Later", "Length", "Level", "LinkName", "Live", "Looks", "MessageLimits", "MessageName",
    "MissionOver", "MissionWaits", "Name", "Navigates", "NeedsExtra", "NumberRange", "OpensPort", "Out", "Outcome",
    "OutsideError", "Place", "PlaceName", "Port", "Pose2", "PutsThings", "Qos", "Query", "Ratio", "Refused",
    "Replaceable", "Reply", "RobotHeld", "RollsOn", "RunsMissions", "Secret", "SeesEdges", "SensesPhysics",
    "SentGoal", "ServedGoal", "Serves", "ServesAction", "ServesTopic", "Setting", "Speed", "StampTask", "TaskStatus",
    "Time", "Warns", "WritesFrame", "answers", "component", "heartbeat", "skill",
]  # fmt: skip
