"""Compare a compiled robot with the running one, and apply the changes."""

from __future__ import annotations

from typing import Any

from rbxcompose.cli.robots.lookup import answer_of, find_robot
from rbxcompose.dataclass import dataclass
from rbxcompose.inspection.changes_text import changes_text, with_places
from rbxcompose.model.robot import Robot
from rbxcompose.plan.dump import dump
from rbxcompose.plan.model import Plan
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.options import ChosenLayers
from rbxcompose.runtime.plan_requests import ApplyPlan, ComparePlan, PlanComparison
from rbxcompose.runtime.supervision.changes import Fate
from rbxcompose.runtime.supervision.plan_change import LONGEST
from rbxcompose.typed_json import to_data

_COMPARE = 10.0  # [s] for the supervisor to read a plan
LONGEST_CHANGE = LONGEST + _COMPARE  # [s]


@dataclass(frozen=True, slots=True)
class Proposal:
    """What another plan would change in a running robot, and why it cannot do so now, if it cannot."""

    folder: RobotFolder
    plan: str
    found: PlanComparison
    layers: ChosenLayers
    data: dict[str, Any]
    """What was found, with places in the robot's files, for programs."""

    @classmethod
    def of(cls, plan: Plan, robot: Robot, layers: ChosenLayers) -> Proposal:
        """Ask the running robot of this name what the plan, compiled with these layers, would change.

        Raises:
            NotDoneError: if none is up, or it does not answer.
        """
        folder, text = find_robot(plan.robot), dump(plan, reveals_secrets=True)  # the socket is this user's alone
        found = answer_of(folder, ComparePlan(text), timeout=_COMPARE)
        return cls(folder, text, found, layers, with_places(to_data(found), robot))

    @property
    def is_empty(self) -> bool:
        """Return whether nothing would change."""
        found = self.found
        return not (found.impossible or found.shares_change) and all(one.fate is Fate.KEPT for one in found.components)

    @property
    def why_not(self) -> str:
        """Return why the change is impossible now, or nothing if it is possible."""
        return self.found.why_not

    def text(self) -> str:
        """Return the difference for people."""
        return changes_text(self.data)

    def apply(self) -> str:
        """Apply the changes and return the robot's report.

        Raises:
            NotDoneError: if the robot refuses, applies them only in part, or does not answer.
        """
        return answer_of(self.folder, ApplyPlan(self.plan, self.found.generation, self.layers), timeout=LONGEST_CHANGE)
