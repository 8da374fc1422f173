"""Controllers in a file of ArbotiX: those that follow trajectories, and bases on two wheels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Severity, Span, kind
from rbxcompose.importing.foreign_files import ForeignMap, Given
from rbxcompose.importing.importer import NOT_CARRIED_OVER
from rbxcompose.importing.manifest_text import number

SIMULATED_BASE = kind("RBX2236", Severity.WARNING)

FOLLOW, DIFF = "follow_controller", "diff_controller"
ACTION = "follow_joint_trajectory"
_LINEAR = ("linear_controller", "linear_controller_i")
_WHY_NOT_LINEAR = "the ArbotiX board drives the motor of a linear joint, and only Dynamixel servos are driven here"
_FRAMES = {"base_frame_id": "base_footprint", "odom_frame_id": "odom"}  # of the simulated base
_OF_THE_BOARD = ("base_width", "ticks_meter", "Kp", "Kd", "Ki", "Ko", "rate")


@dataclass(frozen=True, slots=True)
class FollowController:
    """Follows trajectories of joints."""

    name: str
    span: Span = field(compare=False)
    joints: tuple[Given[str], ...]


@dataclass(frozen=True, slots=True)
class DiffController:
    """A base on two wheels; `kept` are the figures that only its board needs, by key."""

    name: str
    span: Span = field(compare=False)
    acceleration: Given[float] | None
    timeout: Given[float] | None
    kept: Mapping[str, Given[float]]


def read_controller(name: str, told: ForeignMap) -> FollowController | DiffController | None:
    """Return a controller, or None after the finding that says why it is left out."""
    type_ = told.needs("type", told.choice("type", (FOLLOW, DIFF, *_LINEAR)))
    if type_ is None:
        return None
    if type_.value in _LINEAR:
        told.tell(NOT_CARRIED_OVER.at(type_.span, f"{told.what} is not carried over: {_WHY_NOT_LINEAR}"))
        return None
    found = _follow(name, told) if type_.value == FOLLOW else _diff(name, told)
    told.tell_others()
    return found


def _follow(name: str, told: ForeignMap) -> FollowController | None:
    joints = told.needs("joints", told.texts("joints"))
    told.places("rate", "index")  # that of the bus counts, and nothing has a number here
    if told.is_set("onboard"):
        words = f"'onboard' of {told.what} is not carried over: trajectories are interpolated here, not on a board"
        told.tell(NOT_CARRIED_OVER.at(told.places("onboard")["onboard"], words))
    _tell_action(name, told)
    return FollowController(name, told.span, tuple(joints)) if joints else None


def _tell_action(name: str, told: ForeignMap) -> None:
    """Tell if clients know the action by another name than it has now."""
    given, ours = told.text("action_name"), f"{name}/{ACTION}"
    old = given.value if given else ACTION
    if old.strip("/") != ours:
        words = f"the name '{old}' of the action of {told.what} is not carried over: it is '{ours}' here"
        span = given.span if given else told.span
        told.tell(NOT_CARRIED_OVER.at(span, words, help="send goals to that name"))


def _diff(name: str, told: ForeignMap) -> DiffController:
    for key, ours in _FRAMES.items():
        frame = told.text(key)
        if frame is not None and frame.value.strip("/") != ours:
            words = f"'{key}' of {told.what} is not carried over: the frame is '{ours}' here"
            told.tell(NOT_CARRIED_OVER.at(frame.span, words))
    kept = {key: found for key in _OF_THE_BOARD if (found := told.number(key)) is not None}
    base = DiffController(name, told.span, told.above_zero("accel_limit"), told.above_zero("timeout"), kept)
    words = f"{told.what} becomes a simulated base: the ArbotiX board drives the real one by its own firmware"
    told.tell(SIMULATED_BASE.at(told.span, words, help=_figures(base)))
    return base


def _figures(base: DiffController) -> str:
    known = [f"{key} {number(base.kept[key].value)}" for key in ("base_width", "ticks_meter") if key in base.kept]
    return f"the real one has {' and '.join(known)}; a comment keeps that" if known else ""
