"""The robot that runs, as the page changes it to what its files say: by `apply`, and back again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from rbxcompose.base.findings import Severity
from rbxcompose.base.requests import Refused
from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.lookup import answer_of
from rbxcompose.compiler.compile import Compilation
from rbxcompose.runtime.folder import ChosenLayers, RobotFolder
from rbxcompose.runtime.plan_requests import RevertPlan
from rbxcompose.tools.robot_changes import LONGEST_CHANGE, Proposal


class LiveRobot:
    """Answers what a page asks about the robot that runs; `compiled` compiles it with the `layers` that it has."""

    def __init__(
        self, folder: RobotFolder, compiled: Callable[[Mapping[Path, str]], Compilation], layers: ChosenLayers
    ) -> None:
        self._folder, self._compiled, self._layers = folder, compiled, layers

    def answer(self, request: Mapping[str, Any]) -> Any:
        """Return the answer to a request: its `do`, and the `generation` of the plan that a person has seen.

        Raises:
            Refused: with the reason.
        """
        try:
            return LIVE_REQUESTS[request["do"]](self, request)
        except NotDoneError as error:
            raise Refused(error.finding.message) from error

    def _compare(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Return what would change in the robot that runs, and what prevents it."""
        proposal = self._proposal()
        changed = [one for one in proposal.data["components"] if one["fate"] != "kept"]
        return {
            "generation": proposal.found.generation,
            "is_empty": proposal.is_empty,
            "why_not": proposal.why_not,
            "components": [{key: one[key] for key in ("name", "fate", "reasons")} for one in changed],
            "said": list(proposal.found.said),
        }

    def _apply(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Change the robot that runs to what its files say, if it is still the one that was compared."""
        proposal = self._proposal()
        if proposal.found.generation != request["generation"]:
            raise Refused("the robot was changed by someone else meanwhile: look at the difference again")
        if proposal.why_not:
            raise Refused(proposal.why_not)
        return {"text": proposal.apply(), "generation": proposal.found.generation}

    def _revert(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Take a change back; the files stay as they are."""
        return {"text": answer_of(self._folder, RevertPlan(request["generation"]), timeout=LONGEST_CHANGE)}

    def _proposal(self) -> Proposal:
        if self._layers.system:
            raise Refused("this robot belongs to a system, which is changed as a whole by 'rbxcompose apply'")
        made = self._compiled({})
        if made.plan is None or made.robot is None:
            found = [one for one in made.report if one.severity is Severity.ERROR]
            raise Refused(f"its files have {len(found)} errors, the first: {found[0].message}")
        return Proposal.of(made.plan, made.robot, self._layers)


LIVE_REQUESTS: Mapping[str, Callable[[LiveRobot, Mapping[str, Any]], Any]] = MappingProxyType(
    {"robot/compare": LiveRobot._compare, "robot/apply": LiveRobot._apply, "robot/revert": LiveRobot._revert}
)
