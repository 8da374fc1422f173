"""The arm of `pi_robot` at its table, without a bus: motions and grips end at once."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.arm_config import ArmConfig, ArmWorks
from rbxcompose.domains.arms.goals import goal_of
from rbxcompose.domains.arms.hand import hand_task
from rbxcompose.domains.arms.motion.arm_task import ArmTask
from rbxcompose.domains.arms.motion.hand_task import Gripped, HandTask, PickedObject
from rbxcompose.domains.arms.motion.parametrisation import Trajectory
from rbxcompose.domains.arms.motion.scene import PlacedObject, PlanningScene
from rbxcompose.domains.arms.sections.scene import scene
from rbxcompose.msgs.rbxcompose_msgs import MoveArm, PickObject, PlaceObject
from tests.body.described import described
from tests.shipped import robot_and_plan

FINGER = "right_gripper_finger_joint"


@cache
def made() -> tuple[ArmConfig, tuple[PlacedObject, ...], ArmWorks]:
    """Return the configuration of the arm, the objects on its table, and what plans for it."""
    robot, plan = robot_and_plan("pi_robot", "table")
    description = described(robot.manifest)
    configs: dict[str, Any] = {instance.type: instance.config for instance in plan.instances}
    objects = robot.manifest.contents.of(scene).on(description.body)
    return configs["arm"], objects, ArmWorks(configs["arm"], lambda: 0.0)


class HandBench:
    """A site whose arm is at once where it is sent, and whose gripper closes to `closes_to` [m] at most."""

    def __init__(self, *further: PlacedObject, without: tuple[str, ...] = ()) -> None:
        self.config, objects, self.works = made()
        self.scene = PlanningScene(
            self.works.kinematics.body,
            [*(placed_object for placed_object in objects if placed_object.name not in without), *further],
        )
        self.now, self.problem, self.is_ready, self.poses = 0.0, "", True, self.config.poses
        self.measured = dict.fromkeys((*self.config.joints, FINGER), (0.0, 0.0))
        self.picked: dict[str, PickedObject] = {}
        self.openings: list[float] = []
        self.stages: list[str] = []
        self.slips = 0.0  # [m] by which the gripper closes farther than it was told
        self.problems: dict[str, str] = {}  # by what fails: follow, grip, attach, detach
        self.during: Callable[[str], None] = lambda stage: None
        self.after_step: Callable[[], None] = lambda: None
        self.pending: Callable[[], None] | None = None  # ends the motion that is under way
        self.works.place_objects(self.objects)

    @property
    def objects(self) -> tuple[PlacedObject, ...]:
        return tuple(self.scene.objects.values())

    def follow(self, names: tuple[str, ...], trajectory: Trajectory, ended: Callable[[str, bool], None]) -> None:
        def end() -> None:
            self.measured.update({name: (at, 0.0) for name, at in zip(names, trajectory.positions[-1], strict=True)})
            ended(self.problems.get("follow", ""), False)

        self.stopped = lambda: ended("", True)
        self.pending = end

    def stop_following(self) -> None:
        self.pending = self.stopped

    def report_stage(self, stage: str) -> None:
        self.stages.append(stage)

    def info(self, text: str) -> None:
        assert "positions examined" in text or "is elsewhere" in text

    def grip(self, opening: float, ended: Callable[[Gripped], None]) -> None:
        self.openings.append(opening)
        self.pending = lambda: ended(Gripped(opening - self.slips, self.problems.get("grip", "")))

    def stop_gripping(self) -> None:
        """The gripper ends by itself."""

    def attach(self, name: str, links: tuple[str, ...], ended: Callable[[str], None]) -> None:
        if not (problem := self.problems.get("attach", "")):
            self.scene.attach(name, links[0], links, self._links())
            self.works.place_objects(self.objects)
        ended(problem)

    def detach(self, name: str, ended: Callable[[str], None]) -> None:
        if not (problem := self.problems.get("detach", "")):
            self.scene.detach(name, self._links())
            self.works.place_objects(self.objects)
        ended(problem)

    def _links(self) -> dict[str, Transform3]:
        return self.scene.body.poses({name: at for name, (at, _) in self.measured.items()})

    def carried_out(self, message: PickObject.Goal | PlaceObject.Goal | MoveArm.Goal) -> HandTask | ArmTask:
        """Return the task of a goal when it is over; `during` is called whenever a motion is under way."""
        hand = self.config.hand
        assert hand is not None
        task: HandTask | ArmTask
        if isinstance(message, MoveArm.Goal):
            task = ArmTask(self, self.works.kinematics, self.works.planner, goal_of(message))
        else:
            task = hand_task(self, self.works, hand, message)
        self.task = task
        for _ in range(100_000):
            if task.is_over:
                return task
            task.advance()
            self.after_step()
            if self.pending is not None:
                self.during(self.stages[-1] if isinstance(task, ArmTask) else task.stage)
                pending, self.pending = self.pending, None
                pending()
        raise AssertionError("it does not end")

    def place_of(self, name: str) -> tuple[float, float, float]:
        """Return where an object is in the root's frame [m]."""
        placed_object = self.scene.objects[name]
        return self._links()[placed_object.link].compose(placed_object.pose).translation
