"""A joint whose servos are given positions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from rbxcompose.actuation.joint_drive import JointDrive, Writes
from rbxcompose.actuation.servo_joint import ServoJoint
from rbxcompose.control.curves import JointSample
from rbxcompose.control.joint_states import JointPolicy, JointRequest, MoveTo
from rbxcompose.control.limits import Limiter


class PositionDrive(JointDrive):
    """Leads a joint to positions, along paths or by itself; `speed` is how fast it goes by itself [rad/s or m/s]."""

    def __init__(self, joint: ServoJoint, policy: JointPolicy, speed: float | None = None) -> None:
        super().__init__(joint, policy)
        self.speed = speed

    def follow(self, sample: JointSample) -> None:
        """Be at a position at the end of the next cycle, and pass there with its velocity."""
        self.ask(MoveTo(sample.position, sample.velocity))

    def _goal(self, position: float) -> Writes:
        return {id_: {"goal_position": raw} for id_, raw in self.joint.raws(position).items()}

    def _pursue(self, request: JointRequest, limiter: Limiter, dt: float) -> str:
        if not isinstance(request, MoveTo):
            return f"joint '{self.joint.name}' takes positions"
        limits = self.joint.limits
        if request.velocity is None and self.speed is not None:
            limits = replace(limits, velocity=min(self.speed, limits.speed))
        limiter.limits = limits
        self._tell_clamped(request)
        return limiter.want(request.position, request.velocity or 0.0) or ""

    def _tell_clamped(self, request: MoveTo) -> None:
        """Note that a single command is beyond the limits; controllers tell that of theirs."""
        inside = self.joint.limits.clamped(request.position)
        is_beyond = request.velocity is None and abs(inside - request.position) > self.per_tick
        self.clamped = f"a command for {request.position:g} is clamped to its limit, {inside:g}" if is_beyond else ""

    def _moved(self, dt: float) -> Iterator[Writes]:
        limiter = self.limiter
        if limiter is None:
            return
        before = self.joint.raws(limiter.position)
        goal = self.joint.raws(limiter.step(dt).position)
        if goal != before:
            yield {id_: {"goal_position": raw} for id_, raw in goal.items()}
