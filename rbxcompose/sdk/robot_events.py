"""Events that a component reports to its supervisor because they concern the whole robot."""

from rbxcompose.base.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class MissionOver:
    """A mission has ended with `outcome`; when the one that `up` started ends, the robot may go down."""

    mission: str
    outcome: str
    message: str = ""


@dataclass(frozen=True, slots=True)
class MissionWaits:
    """A mission cannot begin because a value has not arrived; `message` names it."""

    mission: str
    message: str


@dataclass(frozen=True, slots=True)
class RobotHeld:
    """A component needs the robot to stand still, for a `reason`: it is stopped, and not released until that is over.

    An empty reason tells that it is over; the robot still stays stopped until somebody releases it.
    """

    component: str
    reason: str


@dataclass(frozen=True, slots=True)
class ComponentNoted:
    """What people should see of a component in `ps`; an empty text ends it."""

    component: str
    text: str


RobotEvent = MissionOver | MissionWaits | RobotHeld | ComponentNoted
