"""What viewers see of arms and of what is around them, as data for JSON; lengths in [m], angles in [rad]."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from rbxcompose.geometry import Vector3
from rbxcompose.motion.reasons import MotionFailure, StageFailure
from rbxcompose.motion.scene import PlacedObject
from rbxcompose.msgs.types import Message

SCENE_WINDOW, ARM_WINDOW = "scene", "arms"  # paths; that of an arm has its name behind
IDLE = "idle"
_DIGITS = 4  # of a length
_SMALL = 20  # fields of a goal that are told


def scene_parts(objects: Iterable[PlacedObject], problem: str) -> dict[str, Any]:
    """Return the parts of a scene: each object, and why it is not known as a whole, if so."""
    return {"problem": problem, **{f"object {one.name}": _object(one) for one in objects}}


def _object(one: PlacedObject) -> dict[str, Any]:
    shapes = [
        {
            "kind": piece.shape.kind,
            "size": list(piece.shape.size),
            "points": len(piece.shape.points) // 3,
            "position": list(piece.pose.translation),
            "rotation": list(piece.pose.rotation),
        }
        for piece in one.all_pieces
    ]
    return {"link": one.link, "shapes": shapes, "colour": list(one.colour) if one.colour else None}


def goal_words(message: Message) -> str:
    """Return a goal for people: the name of its action, and its fields that are not as usual."""
    usual, name = type(message)(), type(message).TYPE.split("/")[-1].removesuffix("_Goal")
    found = []
    for one in fields(message):  # type: ignore[arg-type]
        value = getattr(message, one.name)
        if isinstance(value, Message) or (
            isinstance(value, tuple) and any(isinstance(each, Message) for each in value)
        ):
            continue  # too much for a line
        value = value.tolist() if isinstance(value, np.ndarray) else value
        other = getattr(usual, one.name)
        if value != (other.tolist() if isinstance(other, np.ndarray) else other):
            shown = list(value) if isinstance(value, tuple) else value
            found.append(f"{one.name}: {shown}")
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
        "way": [[round(one, _DIGITS) for one in point] for point in way],
        "duration": round(duration, _DIGITS),
        "problem": problem,
    }
