"""What an arm with a gripper has beside one without: its ports, picking and placing, pictures of failures."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import Any

from rbxcompose.base.files import replace_file
from rbxcompose.base.geometry import Transform3, quaternion_from_rpy
from rbxcompose.base.units import LENGTH
from rbxcompose.domains.arms.arm_config import ArmConfig, ArmWorks
from rbxcompose.domains.arms.goals import RANGES, SHARES
from rbxcompose.domains.arms.motion import hand_task as hand_tasks
from rbxcompose.domains.arms.motion.arm_task import ArmGoal
from rbxcompose.domains.arms.motion.grasps import Grasp
from rbxcompose.domains.arms.motion.picture import ArmPicture, draw_arm
from rbxcompose.domains.arms.reasons import GRASP_REASONS, MotionReason, StageFailure
from rbxcompose.domains.arms.section_models import GraspModel, HandConfig
from rbxcompose.domains.body.meshes import MissingLibraryError
from rbxcompose.domains.body.model import Body
from rbxcompose.msgs.control_msgs import GripperCommand, GripperCommandMessage
from rbxcompose.msgs.rbxcompose_msgs import AttachObject, DetachObject, PickObject, PlaceObject
from rbxcompose.sdk import Calls, CallsAction, Ended, Outcome, Port, SentGoal, ServesAction
from rbxcompose.sdk.bound import Reply

MOST = 20  # pictures of one arm; the oldest goes when there is one more
NUMBERED = re.compile(r"-(\d{4,9})-[a-z_-]+\.png")
QUOTED = re.compile(r"'([^']+)'")


def picture_of_failure(
    folder: Path, arm: str, works: ArmWorks, positions: Mapping[str, float], failure: StageFailure
) -> str:
    """Draw the body at `positions` [rad or m] of its joints among its things, and what the failure names in red.

    Return the words about it for the failure's text: where the picture is, or why there is none.
    """
    names = set(QUOTED.findall(failure.text))
    caption, problem = f"{arm}: {failure.stage}", f"{failure.reason}: {failure.text}"
    known = works.kinematics.body, works.meshes, positions, works.objects
    shown = ArmPicture(*known, colliding=names, caption=caption, problem=problem)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        there = numbered(folder, arm)
        file = folder / f"{arm}-{max(there, default=0) + 1:04}-{failure.stage}-{failure.reason}.png"
        replace_file(file, draw_arm(shown))
        for number in sorted(there)[: max(0, len(there) + 1 - MOST)]:
            there[number].unlink()
    except MissingLibraryError as error:
        return f"no picture: {error.finding.message}"
    except (OSError, ValueError) as error:
        return f"no picture: {error}"
    return f"picture: {file}"


def numbered(folder: Path, arm: str) -> dict[int, Path]:
    """Return the pictures of an arm by their numbers."""
    files = [path for path in folder.iterdir() if path.name.startswith(f"{arm}-")]
    return {int(found[1]): file for file in files if (found := NUMBERED.fullmatch(file.name.removeprefix(arm)))}


PICK, PLACE, GRIP, ATTACH, DETACH = "pick", "place", "grip", "attach", "detach"  # the ports


def hand_ports(config: ArmConfig) -> dict[str, Port[Any]]:
    """Return the ports of an arm with a gripper; none without."""
    if config.hand is None:
        return {}
    outcomes = dict.fromkeys(GRASP_REASONS, "failure")
    shared: Any = {"claims": config.controller, "outcomes": outcomes, "ranges": RANGES}
    lengths = dict.fromkeys(("approach", "lift", "opening", "squeeze"), LENGTH) | SHARES
    return {
        PICK: ServesAction(PickObject, f"{config.name}/pick", skill=f"pick_{config.name}", measures=lengths, **shared),
        PLACE: ServesAction(
            PlaceObject,
            f"{config.name}/place",
            skill=f"place_{config.name}",
            measures=dict.fromkeys(("x", "y", "z", "tolerance", "approach", "retreat"), LENGTH) | SHARES,
            choices={"spot": tuple(config.hand.spots)} if config.hand.spots else {},
            **shared,
        ),
        GRIP: CallsAction(GripperCommand, config.hand.command),
        ATTACH: Calls(AttachObject, "scene/attach"),
        DETACH: Calls(DetachObject, "scene/detach"),
    }


class PicksAndPlaces:
    """What picking and placing need of an arm, by the ports of its component."""

    bound: dict[str, Any]
    picked: dict[str, hand_tasks.PickedObject]
    """How objects were picked, by name."""
    gripping: SentGoal
    works: ArmWorks
    measured: dict[str, tuple[float, float]]
    """Position and velocity of each joint."""

    def pictured(self, name: str, hand: HandConfig | None, failure: object, result: Any) -> Any:
        """Return a result, whose message names where the picture of the failure is, if it wants one."""
        if hand is None or not hand.pictures or not isinstance(failure, StageFailure):
            return result
        if failure.reason is MotionReason.INTERRUPTED:
            return result
        positions = {joint: at for joint, (at, _) in self.measured.items()}
        said = picture_of_failure(Path(hand.pictures), name, self.works, positions, failure)
        return replace(result, message=f"{result.message}; {said}")

    def grip(self, opening: float, ended: Callable[[hand_tasks.Gripped], None]) -> None:
        """Open or close the gripper [m]."""

        def on_end(end: Ended[GripperCommand.Result]) -> None:
            if end.result is not None and (end.outcome is Outcome.SUCCEEDED or end.result.stalled):
                ended(hand_tasks.Gripped(end.result.position))
            else:
                ended(hand_tasks.Gripped(math.nan, end.message or f"its goal was {end.outcome}"))

        goal = GripperCommand.Goal(command=GripperCommandMessage(position=opening))
        self.gripping = self.bound[GRIP](goal, on_end)

    def stop_gripping(self) -> None:
        """Ask the gripper to end."""
        self.gripping.cancel()

    def attach(self, name: str, links: tuple[str, ...], ended: Callable[[str], None]) -> None:
        """Let an object move with the first of some links, all of which it may touch."""
        request = AttachObject.Request(object=name, link=links[0], touches=links)
        self.bound[ATTACH](request, lambda reply: ended(_problem(reply)))

    def detach(self, name: str, ended: Callable[[str], None]) -> None:
        """Let an object stay where it is."""
        self.bound[DETACH](DetachObject.Request(object=name), lambda reply: ended(_problem(reply)))


def _problem(reply: Reply[Any]) -> str:
    if reply.response is None:
        return reply.error or "the scene does not answer"
    return "" if reply.response.success else str(reply.response.message)


def hand_of(config: HandConfig, works: ArmWorks) -> hand_tasks.Hand:
    """Return the gripper of an arm."""
    kinematics = works.kinematics
    poses = kinematics.body.poses({})
    tip = kinematics.group.tip
    least, greatest = config.opening or (0.0, math.inf)
    return hand_tasks.Hand(
        least, greatest, poses[tip].inverse().compose(poses[config.grasp]), hand_links(kinematics.body, tip)
    )


def hand_links(body: Body, tip: str) -> tuple[str, ...]:
    """Return the tip, and all other links of the hand: those below the first link from the tip up that has fingers.

    Links from the tip up to there are fixed to each other. If nothing below them moves, the tip alone carries the hand.
    """
    links = (tip, *(joint.parent for joint in takewhile(lambda joint: not joint.moves, body.joints_above(tip))))
    palms = (link for link in links if any(body.joint_above[each].moves for each in body.carried(link)))
    palm = next(palms, tip)
    return tip, *(link for link in (palm, *body.carried(palm)) if link != tip)


def hand_task(
    site: hand_tasks.HandSite, works: ArmWorks, config: HandConfig, message: PickObject.Goal | PlaceObject.Goal
) -> hand_tasks.HandTask:
    """Return the task of a goal."""
    hand = hand_of(config, works)
    pace = ArmGoal(speed=message.speed or 1.0, acceleration=message.acceleration or 1.0)
    if isinstance(message, PickObject.Goal):
        given, squeeze = tuple(map(_grasp, config.grasps.get(message.object, ()))), message.squeeze or config.squeeze
        goal = hand_tasks.PickGoal(message.object, message.approach, message.lift, message.opening, squeeze, given)
        return hand_tasks.PickTask(site, works, hand, goal, pace)
    if message.spot and message.spot not in config.spots:
        unknown = f"there is no spot '{message.spot}'; the spots of this arm: {', '.join(config.spots) or 'none'}"
        return hand_tasks.PlaceTask(site, works, hand, hand_tasks.PlaceGoal((0.0, 0.0, 0.0), unknown=unknown), pace)
    at, frame, on, tolerance = (message.x, message.y, message.z), message.frame, message.on, message.tolerance
    if message.spot in config.spots:
        spot = config.spots[message.spot]
        at, frame, on = (spot.x, spot.y, spot.z), spot.frame or "", spot.on or ""
        tolerance = tolerance or spot.tolerance
    place = hand_tasks.PlaceGoal(at, frame, on, tolerance, message.approach, message.retreat)
    return hand_tasks.PlaceTask(site, works, hand, place, pace)


def _grasp(model: GraspModel) -> Grasp:
    pose = Transform3((model.x, model.y, model.z), quaternion_from_rpy(model.roll, model.pitch, model.yaw))
    return Grasp(pose, model.width, model.quality)


def result_of(
    message: PickObject.Goal | PlaceObject.Goal, task: hand_tasks.HandTask
) -> PickObject.Result | PlaceObject.Result:
    """Return how a task has ended."""
    kind = PickObject.Result if isinstance(message, PickObject.Goal) else PlaceObject.Result
    held, failure = task.held.name if task.held is not None else "", task.failure
    if failure is None:
        return kind(held=held)
    words = f"{failure.stage}: {failure.text}" + (f"; it holds '{held}'" if held else "")
    return kind(outcome=failure.reason, message=words, stage=failure.stage, held=held)
