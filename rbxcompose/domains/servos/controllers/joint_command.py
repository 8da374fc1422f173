"""Leads several joints to positions that one message commands together."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from pydantic import Field

from rbxcompose.base.config import JointName, Time
from rbxcompose.domains.servos.controller import Controller, ControllerConfig, controller
from rbxcompose.domains.servos.curves import JointSample
from rbxcompose.msgs.rbxcompose_msgs import MoveJoints
from rbxcompose.msgs.std_msgs import Float64MultiArray
from rbxcompose.sdk import ArrayEntries, In, Port, ServedGoal, ServesAction

MOVE = "move"


class JointCommandConfig(ControllerConfig):
    """Leads several joints to positions that one message commands together."""

    type: Literal["joint_command"] = "joint_command"
    """How it leads its joints."""
    joints: list[JointName] = Field(min_length=1)
    """The joints that it leads, in the order of the commands."""
    timeout: Time = Field(0.0, ge=0)
    """Without a new command for this long, the joints come to rest before they have arrived; 0 is never."""

    @property
    def claimed(self) -> tuple[str, ...]:
        """Return the joints that it leads."""
        return tuple(self.joints)


@controller("joint_command")
class JointCommandController(Controller[JointCommandConfig]):
    """Leads joints to the positions on the topic `NAME/commands`, one for each joint, in their order [rad or m].

    Each joint goes as fast as its limits allow. From a command until all have arrived, no others are taken for single
    joints. A command of another length, or with a number that is not finite, is refused as a whole. The action
    `NAME/move` names some of the joints, and is the skill of missions; it has no duration.

    Example:
        gaze: {type: joint_command, joints: [pan_joint, tilt_joint], timeout: 0.5 s}
    """

    @classmethod
    def ports(cls, name: str, config: JointCommandConfig) -> dict[str, Port[Any]]:
        """Return the topic and the action."""
        entries = ArrayEntries("joints", "positions", config.dimensions)
        return {
            "commands": In(Float64MultiArray, f"{name}/commands", qos="command", is_open=True),
            MOVE: ServesAction(MoveJoints, f"{name}/{MOVE}", claims=name, skill=name, entries=entries),
        }

    def prepare(self) -> None:
        """Wait for a command."""
        self.wanted: dict[str, float] = {}  # positions of joints that have not arrived together
        self.commanded_at = -math.inf
        self.problem = ""
        self.goal: ServedGoal[Any, Any, Any] | None = None  # which asked for what is wanted

    @property
    def leads(self) -> bool:
        """Return whether its joints are on their way."""
        return bool(self.wanted)

    @property
    def note(self) -> str:
        """Return what was wrong with the last command."""
        return self.problem

    def received(self, port: str, message: Float64MultiArray) -> None:
        """Take a command, or refuse it."""
        names, positions = self.config.joints, [float(item) for item in message.data]
        self.problem = self._objection(names, positions)
        if not self.problem:
            self._end("replaced by a command")
            self._want(dict(zip(names, positions, strict=True)))

    def accept(self, port: str, goal: MoveJoints.Goal) -> str:
        """Refuse what names joints that it does not lead, or none."""
        odd = next((name for name in goal.joints if name not in self.config.joints), None)
        if odd is not None or not goal.joints:
            return f"it leads {', '.join(self.config.joints)}, not {odd or 'nothing'}"
        return self._objection(goal.joints, [float(position) for position in goal.positions])

    def _want(self, positions: Mapping[str, float]) -> None:
        self.wanted, self.commanded_at = {}, self.site.now
        for name, position in positions.items():
            self.wanted[name] = self.site.joints[name].rules.limits.clamped(position)
            if self.wanted[name] != position and not self.problem:
                self.problem = f"joint '{name}' does not go to {position:g}: its limit is {self.wanted[name]:g}"

    def _objection(self, names: Sequence[str], positions: list[float]) -> str:
        if len(positions) != len(names):
            return f"a command had {len(positions)} positions, not {len(names)}: {', '.join(names)}"
        odd = next((name for name, position in zip(names, positions, strict=True) if not math.isfinite(position)), None)
        return "" if odd is None else f"a command for '{odd}' was no finite number"

    def cycle(self, now: float, dt: float) -> None:
        """Lead the joints on, until they have arrived."""
        self._take(now)
        if not self.wanted:
            return
        for name, joint in self.site.joints.items():
            if joint.blocked:
                self.halt(now, f"joint '{name}': {joint.blocked}")
                return
        if self.goal is None and 0.0 < self.config.timeout < now - self.commanded_at - dt / 2:
            self.halt(now, f"no command for {self.config.timeout:g} s")
            return
        for name, position in self.wanted.items():
            self.site.joints[name].follow(JointSample(position))
        if all(self._has_arrived(name, dt) for name in self.wanted):
            self.wanted = {}
            self._end("")

    def _take(self, now: float) -> None:
        """Take over a new goal, or the cancellation of the one that leads."""
        goal = self.site.goal(MOVE)
        if goal is not None and goal.cancel_requested:
            self.goal = None
            self.halt(now, "canceled")
            goal.canceled(MoveJoints.Result(message="canceled"))
        elif goal is not None and goal is not self.goal:
            self.goal, self.problem = goal, ""
            self._want(dict(zip(goal.request.joints, map(float, goal.request.positions), strict=True)))

    def _end(self, reason: str) -> None:
        """End the goal, as failed if there is a reason."""
        goal, self.goal = self.goal, None
        if goal is not None and reason:
            goal.aborted(reason, MoveJoints.Result(message=reason))
        elif goal is not None:
            goal.succeeded(MoveJoints.Result(message=self.problem))

    def _has_arrived(self, name: str, dt: float) -> bool:
        joint = self.site.joints[name]
        at = joint.commanded
        return max(abs(at.position - self.wanted[name]), abs(at.velocity) * dt) < joint.per_tick / 2

    def halt(self, now: float, reason: str) -> None:
        """Bring its joints to rest."""
        if self.wanted:
            self.wanted, self.problem = {}, reason
            self._end(reason)
            for joint in self.site.joints.values():
                joint.hold()
