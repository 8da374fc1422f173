"""A joint whose servos are given velocities: a wheel, or a spindle."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rbxcompose.actuation.joint_drive import JointDrive, Writes
from rbxcompose.control.joint_states import JointRequest, MoveAt
from rbxcompose.control.limits import Limiter


class VelocityDrive(JointDrive):
    """Moves a joint with velocities that hold for one cycle each; without one it brakes within its limits."""

    _sent: Mapping[int, int] = {}  # raw velocities by id

    def turn(self, velocity: float) -> None:
        """Move with a velocity [rad/s or m/s] up to the end of the next cycle."""
        self.ask(MoveAt(velocity))

    def _goal(self, position: float) -> Writes:
        self._sent = dict.fromkeys(self.joint.ids, 0)
        return self._same({"goal_velocity": 0})

    def was_cut(self) -> None:
        """Go on from rest: a servo has stopped by itself."""
        super().was_cut()
        self._sent = {}

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
        raws = self.joint.wheel_raws(velocity, self.measured.position)
        is_lost = velocity == 0.0 and abs(self.measured.velocity) > self.joint.least_velocity
        if raws != self._sent or is_lost:  # nobody confirms a group write, and a wheel must stop
            self._sent = raws
            yield {id_: {"goal_velocity": raw} for id_, raw in raws.items()}
