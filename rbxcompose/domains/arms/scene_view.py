"""What viewers see of arms and of what is around them, and what people may ask of the planning scene."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any

from rbxcompose.base.arrays import np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Vector3
from rbxcompose.base.requests import Command, Query
from rbxcompose.domains.arms.motion.scene import PairDistance, PlacedObject
from rbxcompose.domains.arms.reasons import MotionFailure, StageFailure
from rbxcompose.msgs.types import Message

SCENE, ARM = "scene", "arm"


@dataclass(frozen=True, slots=True)
class ArmView:
    """What an arm knows now: its body, positions of joints [rad or m], objects, and pairs, the nearest first.

    `watched` are the links and objects that may belong to pairs, of which there may be more than are reported.
    `way` is what was last planned: positions of the tip in the frame of the body's root [m].
    """

    arm: str
    urdf: str
    meshes: Mapping[str, str]
    positions: Mapping[str, float]
    objects: tuple[PlacedObject, ...]
    pairs: tuple[PairDistance, ...]
    watched: tuple[str, ...]
    way: tuple[Vector3, ...] = ()


@dataclass(frozen=True, slots=True)
class ViewOfArm(Query[ArmView]):
    """Return what an arm knows now, with the pairs that have all of `between`, of one or two links or objects.

    `component` is the arm, the first one without it.
    """

    about = ARM
    component: str = ""
    between: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class LookAtArm(Query[Mapping[str, Any]]):
    """Return all that viewers see of an arm, as the window `arms/NAME` shows it."""

    about = ARM


@dataclass(frozen=True, slots=True)
class LookAtScene(Query[Mapping[str, Any]]):
    """Return all that viewers see of the scene, as the window `scene` shows it."""

    about = SCENE


@dataclass(frozen=True, slots=True)
class ListScene(Query[tuple[PlacedObject, ...]]):
    """Return all objects."""

    about = SCENE


@dataclass(frozen=True, slots=True)
class StandingObjects(Query[tuple[PlacedObject, ...]]):
    """Return the objects that no moving link carries, with their poses in the frame of the body's root."""

    about = SCENE


@dataclass(frozen=True, slots=True)
class AddToScene(Command):
    """Put an object into the scene; without a link it stands in the frame of the body's root."""

    about = SCENE
    written = "scene add {0.entry.name}"
    entry: PlacedObject


@dataclass(frozen=True, slots=True)
class LoadScene(Command):
    """Put the objects of the text of a scene file into the scene, all or none, in place of those with their names.

    They stand in the frame of `link`, the body's root without one. `file` is the name of the file in messages.
    """

    about = SCENE
    written = "scene load {0.file}"
    text: str
    file: str
    link: str = ""


@dataclass(frozen=True, slots=True)
class RemoveFromScene(Command):
    """Take an object out of the scene."""

    about = SCENE
    written = "scene remove {0.object}"
    object: str


@dataclass(frozen=True, slots=True)
class AttachInScene(Command):
    """Let an object move with a link; without `touches`, it may touch the link and all that the link carries."""

    about = SCENE
    written = "scene attach {0.object} {0.link}"
    object: str
    link: str
    touches: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class DetachInScene(Command):
    """Let an object stay where it is."""

    about = SCENE
    written = "scene detach {0.object}"
    object: str


@dataclass(frozen=True, slots=True)
class RecallScene(Command):
    """What was in the scene before its component started again: objects and paddings of links [m].

    `stood_in` has the frames outside of the body in which held objects stood, by name of the object.
    """

    about = SCENE
    objects: tuple[PlacedObject, ...]
    stood_in: Mapping[str, str]
    paddings: Mapping[str, float]


SCENE_WINDOW, ARM_WINDOW = "scene", "arms"  # paths; that of an arm has its name behind
IDLE = "idle"
_DIGITS = 4  # of a length
_SMALL = 20  # fields of a goal that are shown


def scene_parts(objects: Iterable[PlacedObject], problem: str) -> dict[str, Any]:
    """Return the parts of a scene: each object, and why it is not known as a whole, if so."""
    return {"problem": problem, **{f"object {thing.name}": _object(thing) for thing in objects}}


def _object(thing: PlacedObject) -> dict[str, Any]:
    shapes = [
        {
            "kind": piece.shape.kind,
            "size": list(piece.shape.size),
            "points": len(piece.shape.points) // 3,
            "position": list(piece.pose.translation),
            "rotation": list(piece.pose.rotation),
        }
        for piece in thing.all_pieces
    ]
    return {"link": thing.link, "shapes": shapes, "colour": list(thing.colour) if thing.colour else None}


def goal_words(message: Message) -> str:
    """Return a goal for people: the name of its action, and its fields that are not as usual."""
    usual, name = type(message)(), type(message).TYPE.split("/")[-1].removesuffix("_Goal")
    found = []
    for field in fields(message):  # type: ignore[arg-type]
        value = getattr(message, field.name)
        if isinstance(value, Message) or (
            isinstance(value, tuple) and any(isinstance(each, Message) for each in value)
        ):
            continue  # too much for a line
        value = value.tolist() if isinstance(value, np.ndarray) else value
        other = getattr(usual, field.name)
        if value != (other.tolist() if isinstance(other, np.ndarray) else other):
            shown = list(value) if isinstance(value, tuple) else value
            found.append(f"{field.name}: {shown}")
    return " ".join((name, *([f"{{{', '.join(found[:_SMALL])}}}"] if found else [])))


def ended_words(failure: MotionFailure | StageFailure | None) -> dict[str, str]:
    """Return how a goal has ended."""
    if failure is None:
        return {"outcome": "succeeded", "message": ""}
    return {"outcome": str(failure.reason), "message": failure.text}


def arm_parts(
    name: str, stage: str, goal: str, ended: Mapping[str, str], way: Iterable[Vector3], duration: float, problem: str
) -> dict[str, Any]:
    """Return the parts of an arm: its goal and stage, how the last goal ended, and the plan as positions of the tip."""
    return {
        "arm": name,
        "state": stage or IDLE,
        "goal": goal,
        "outcome": ended.get("outcome", ""),
        "message": ended.get("message", ""),
        "way": [[round(value, _DIGITS) for value in point] for point in way],
        "duration": round(duration, _DIGITS),
        "problem": problem,
    }
