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
    ConnectedBy,
    Drains,
    Drives,
    ExpectsRate,
    Forwards,
    LocksInSilence,
    MeasuresIn,
    Navigates,
    NeedsExtra,
    OpensPort,
    PutsThings,
    RollsOn,
    RunsContainer,
    RunsMissions,
    RunsProgram,
    RunsRosNode,
    SeesEdges,
    SensesPhysics,
    ServesPage,
    Setting,
    SharesWorld,
    TurnsJoints,
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
    "CompositeTask", "Config", "ConnectedBy", "Drains", "Drives", "Ended", "ExpectsRate", "Forwards", "Frequency",
    "FrequencyTask", "In", "JointName", "Later", "Length", "Level", "LinkName", "Live", "LocksInSilence", "Looks",
    "MeasuresIn", "MessageLimits", "MessageName", "MissionOver", "MissionWaits", "Name", "Navigates", "NeedsExtra",
    "NumberRange", "OpensPort", "Out", "Outcome", "OutsideError", "Place", "PlaceName", "Port", "Pose2",
    "PutsThings", "Qos", "Query", "Ratio", "Refused", "Replaceable", "Reply", "RobotHeld", "RollsOn",
    "RunsContainer", "RunsMissions", "RunsProgram", "RunsRosNode", "Secret", "SeesEdges", "SensesPhysics",
    "SentGoal", "ServedGoal", "Serves", "ServesAction", "ServesPage", "ServesTopic", "Setting", "SharesWorld",
    "Speed", "StampTask", "TaskStatus", "Time", "TurnsJoints", "Warns", "WritesFrame", "answers", "component",
    "heartbeat", "skill",
]  # fmt: skip
