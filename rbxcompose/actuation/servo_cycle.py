"""The cycle of a bus of servos: read, decide, follow trajectories, write. It uses no thread and no messages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import zip_longest

from rbxcompose.actuation.bus import ServoBus
from rbxcompose.actuation.joint_drive import JointDrive
from rbxcompose.control.curves import JointSample
from rbxcompose.control.joint_states import Relax
from rbxcompose.control.trajectory import TrajectoryGoal, TrajectoryRefusal
from rbxcompose.control.trajectory_follower import TrajectoryFollower, TrajectoryOutcome
from rbxcompose.control.trajectory_plan import TrajectoryPlan

FAST = ("present_position", "present_speed")
SLOW = ("present_temperature", "present_voltage")


@dataclass(slots=True)
class ServoCycle:
    """The joints of a bus by name, and the controllers that lead some of them, by name."""

    bus: ServoBus
    drives: Mapping[str, JointDrive]
    followers: Mapping[str, TrajectoryFollower] = field(default_factory=dict)
    _turn: int = 0  # whose slow items are read next

    def run(self, now: float, dt: float) -> dict[str, TrajectoryOutcome]:
        """Do what is due at `now` [s], `dt` [s] before the next cycle; return how trajectories ended, by controller.

        Raises:
            PortError: if the bus has gone.
        """
        self._read()
        outcomes = dict(self._lead(now))
        stages = [drive.step(now, dt) for drive in self.drives.values()]
        ids = [drive.joint.id for drive in self.drives.values()]
        for stage in zip_longest(*stages):
            if writes := {id_: raw for id_, raw in zip(ids, stage, strict=True) if raw}:
                self.bus.write(writes)
        return outcomes | dict(self._lost(now))

    def accept(self, controller: str, goal: TrajectoryGoal, now: float) -> TrajectoryPlan | TrajectoryRefusal:
        """Take over a trajectory, or return why not."""
        follower = self.followers[controller]
        return follower.accept(goal, now, *self._samples(follower))

    def halt(self, now: float, reason: str) -> dict[str, TrajectoryOutcome]:
        """Bring all trajectories to rest; return how they ended."""
        ended = ((name, follower.abort(now, reason)) for name, follower in self.followers.items())
        return {name: outcome for name, outcome in ended if outcome is not None}

    def relax(self, now: float, dt: float) -> None:
        """Switch all torque off, twice, since nobody confirms a group write."""
        for drive in self.drives.values():
            drive.ask(Relax())
            drive.step(now, dt)
        for _ in range(2):
            self.bus.write({drive.joint.id: {"torque_enable": 0} for drive in self.drives.values()})

    def _read(self) -> None:
        drives = list(self.drives.values())
        found = self.bus.read([drive.joint.id for drive in drives], FAST)
        for drive in drives:
            if (reading := found.get(drive.joint.id)) is not None:
                drive.take(reading)
        drive = drives[self._turn % len(drives)]
        self._turn += 1
        items = [*SLOW, "hardware_error"] if drive.joint.model.protocol == 2 else SLOW
        if (slow := self.bus.read([drive.joint.id], items).get(drive.joint.id)) is not None:
            drive.take(slow)

    def _lead(self, now: float) -> Iterator[tuple[str, TrajectoryOutcome]]:
        for name, follower in self.followers.items():
            step = follower.step(now, *self._samples(follower))
            for joint, sample in step.desired.items():
                self.drives[joint].follow(sample)
            if step.outcome is not None:
                yield name, step.outcome

    def _lost(self, now: float) -> Iterator[tuple[str, TrajectoryOutcome]]:
        """Yield the trajectories that end because one of their joints may not move."""
        for name, follower in self.followers.items():
            for joint in follower.joints:
                drive = self.drives[joint]
                if follower.is_moving and drive.condition.is_blocked:
                    reason = f"joint '{joint}': {drive.condition.note or drive.mode}"
                    if (outcome := follower.lose(joint, now, reason)) is not None:
                        yield name, outcome

    def _samples(self, follower: TrajectoryFollower) -> tuple[dict[str, JointSample], dict[str, JointSample]]:
        """Return what is measured and what is commanded of the joints of a controller."""
        drives = {name: self.drives[name] for name in follower.joints}
        measured = {name: drive.measured for name, drive in drives.items()}
        return measured, {name: drive.commanded for name, drive in drives.items()}
