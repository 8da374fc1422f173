"""Comparing a compiled robot with the one that runs, and letting it take the changes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

from rbxcompose.cli.common.robots import find_robot, request
from rbxcompose.model.robot import Robot
from rbxcompose.plan.dump import dump
from rbxcompose.plan.model import Plan
from rbxcompose.runtime.changes import Fate
from rbxcompose.runtime.changing import LONGEST
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.seeing.changes_text import changes_text, with_places

_COMPARE = 10.0  # [s] for the supervisor to read a plan
_APPLY = LONGEST + _COMPARE  # [s]


@dataclass(frozen=True, slots=True)
class Proposal:
    """What another plan would change in a robot that runs, and why it cannot now, if so."""

    folder: RobotFolder
    plan: str
    found: dict[str, Any]

    @classmethod
    def of(cls, plan: Plan, robot: Robot) -> Proposal:
        """Ask the running robot of this name what the plan would change.

        Raises:
            NotDoneError: if none is up, or it does not answer.
        """
        folder, text = find_robot(plan.robot), dump(plan, reveals_secrets=True)  # the socket is this user's alone
        found = cast(dict[str, Any], request(folder, {"verb": "changes", "plan": text}, timeout=_COMPARE))
        return cls(folder, text, with_places(found, robot))

    @property
    def is_empty(self) -> bool:
        """Tell whether there is nothing to do."""
        return not self.found["impossible"] and all(one["fate"] == Fate.KEPT for one in self.found["components"])

    @property
    def why_not(self) -> str:
        """Return why it cannot be done now, or nothing if it can."""
        return str(self.found["why_not"])

    def text(self) -> str:
        """Return the difference for people."""
        return changes_text(self.found)

    def apply(self) -> str:
        """Let the robot take the changes and return what it tells of it.

        Raises:
            NotDoneError: if it refuses, does them only in part, or does not answer.
        """
        fields = {"verb": "apply", "plan": self.plan, "generation": self.found["generation"]}
        return str(request(self.folder, fields, timeout=_APPLY))
