"""Grippers of ArbotiX: parameters of its gripper controller, which is a program of its own."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Severity, Span, kind
from rbxcompose.importing.foreign_files import ForeignMap, Given
from rbxcompose.importing.manifest_text import angle, flag, flow_list, length, number, place, word
from rbxcompose.manifest.validate import OUT_OF_RANGE

NO_OPENING = kind("RBX2237", Severity.WARNING)

MODELS = {"singlesided": "one_sided", "dualservo": "dual", "parallel": "parallel"}
PAD_WIDTH, FINGER_LENGTH, MIN_OPENING, MAX_OPENING = 0.01, 0.02, 0.0, 0.09  # defaults of the controller [m]
_JOINTS = {
    "one_sided": {"joint": "gripper_joint"},
    "dual": {"joint_left": "l_gripper_joint", "joint_right": "r_gripper_joint"},
    "parallel": {"joint": "gripper_joint"},
}
_DRIVER = "a default of the controller"

Lines = dict[str, tuple[str, str]]
"""Lines below the name of a controller: key -> value and comment."""


@dataclass(frozen=True, slots=True)
class ArbotixGripper:
    """A gripper: its joints, and the lines of a manifest."""

    name: str
    span: Span = field(compare=False)
    joints: tuple[Given[str], ...]
    lines: Mapping[str, tuple[str, str]] = field(compare=False)
    values: tuple[str, ...]


def read_gripper(name: str, told: ForeignMap) -> ArbotixGripper | None:
    """Return a gripper, or None after the finding that says why it is left out."""
    model = told.choice("model", MODELS)
    if model is None:
        return None
    kind_of = MODELS[model.value]
    joints = tuple(told.text(key) or Given(usual, told.span) for key, usual in _JOINTS[kind_of].items())
    lines: Lines = {"type": ("gripper", ""), "model": (kind_of, place(model.span))}
    keys = ("left", "right") if len(joints) > 1 else ("joint",)
    lines |= {key: (word(one.value), place(one.span)) for key, one in zip(keys, joints, strict=True)}
    lines |= _scale(told) if kind_of == "parallel" else _geometry(told)
    lines |= _two_sides(told) if kind_of == "dual" else _one_side(told, kind_of)
    told.tell_others()
    return ArbotixGripper(name, told.span, joints, lines, tuple(value for value, _ in lines.values()))


def _geometry(told: ForeignMap) -> Lines:
    """Return the lengths of the fingers and how far they open: opening = pad_width + 2 finger_length sin(angle)."""
    pad, finger = told.number("pad_width"), told.above_zero("finger_length")
    lines = {
        "pad_width": _length(pad, PAD_WIDTH),
        "finger_length": _length(finger, FINGER_LENGTH),
    }
    furthest = (pad.value if pad else PAD_WIDTH) + 2 * (finger.value if finger else FINGER_LENGTH)
    return lines | _opening(told, furthest)


def _length(found: Given[float] | None, usual: float) -> tuple[str, str]:
    return (length(found.value), place(found.span)) if found else (length(usual), _DRIVER)


def _opening(told: ForeignMap, furthest: float) -> Lines:
    least, greatest = told.number("min_opening"), told.number("max_opening")
    low = least.value if least else MIN_OPENING
    high = greatest.value if greatest else min(MAX_OPENING, furthest)
    if 0 <= low < high <= furthest:
        given = [place(one.span) for one in (least, greatest) if one]
        return {"opening": (flow_list([length(low), length(high)]), ", ".join(dict.fromkeys(given)) or _DRIVER)}
    given_at = least if least and low < 0 else greatest or least
    reason = "the least is below 0" if low < 0 else f"the fingers open from 0 m to {number(round(furthest, 6))} m"
    words = f"{told.what} cannot open from {number(low)} m to {number(high)} m, so that is left out: {reason}"
    help_text = "openings are distances between the pads in metres; these look like angles of the joint in radians"
    told.tell(NO_OPENING.at(given_at.span if given_at else told.span, words, help=help_text))
    return {}


def _scale(told: ForeignMap) -> Lines:
    scale = told.number("scale")
    if scale is not None and not scale.value:
        told.tell(OUT_OF_RANGE.at(scale.span, f"'scale' of {told.what} must not be 0", help="it is left out"))
        scale = None
    value = scale.value if scale else 1.0
    where = place(scale.span) if scale else _DRIVER
    words = f"{where}: {number(value)} rad/m; how far it opens is not in the file: write 'opening'"
    lines = {"travel": (length(round(math.tau / abs(value), 7)), words)}
    return lines if value > 0 else lines | {"invert": (flag(True), where)}


def _one_side(told: ForeignMap, kind_of: str) -> Lines:
    center = told.number("center")
    lines = {"center": (angle(center.value), place(center.span))} if center else {}
    if kind_of == "one_sided" and told.is_set("invert"):
        lines["invert"] = (flag(True), place(told.places("invert")["invert"]))
    return lines


def _two_sides(told: ForeignMap) -> Lines:
    lines: Lines = {}
    for key in ("center_left", "center_right"):
        if (center := told.number(key)) is not None:
            lines[key] = (angle(center.value), place(center.span))
    for key in ("invert_left", "invert_right"):
        if (invert := told.flag(key)) is not None and invert.value:
            lines[key] = (flag(True), place(invert.span))
    return lines
