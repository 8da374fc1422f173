"""A joint whose servos are given velocities: a wheel, or a spindle."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.actuation.joint_drive import JointDrive, Writes
from rbxcompose.control.joint_states import JointRequest, MoveAt
from rbxcompose.control.limits import Limiter


class VelocityDrive(JointDrive):
    """Moves a joint with velocities that hold for one cycle each; without one it brakes within its limits."""

    _sent = 0.0  # [rad/s or m/s]

    def turn(self, velocity: float) -> None:
        """Move with a velocity [rad/s or m/s] up to the end of the next cycle."""
        self.ask(MoveAt(velocity))

    def _goal(self, position: float) -> Writes:
        self._sent = 0.0
        return self._same({"goal_velocity": 0})

    def _pursue(self, request: JointRequest, limiter: Limiter, dt: float) -> str:
        if not isinstance(request, MoveAt):
            return f"joint '{self.joint.name}' takes velocities"
        limiter.position = self.measured.position
        return limiter.want(limiter.position + request.velocity * dt, request.velocity) or ""

    def _moved(self, dt: float) -> Iterator[Writes]:
        limiter = self.limiter
        if limiter is None:
            return
        velocity = limiter.step(dt).velocity
        limiter.position = self.measured.position
        limiter.want(limiter.position)  # unless it is repeated
        if velocity != self._sent:
            self._sent = velocity
            raws = self.joint.wheel_raws(velocity, self.measured.position)
            yield {id_: {"goal_velocity": raw} for id_, raw in raws.items()}
