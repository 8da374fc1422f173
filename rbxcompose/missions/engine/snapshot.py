"""Snapshots of an engine as plain data: a restored engine continues exactly as the saved one would have.

A snapshot is restored into an engine made from the same program, robot and settings. What runs outside (requested
skills) is up to its world.
"""

import math
from collections.abc import Mapping
from typing import Any

from rbxcompose.base.config import Place
from rbxcompose.base.expressions.values import MOST_LEVELS, NOT_ARRIVED, NotArrived, Value
from rbxcompose.base.geometry import Pose2
from rbxcompose.base.printable import plain as plain_text
from rbxcompose.missions.engine.build import Since
from rbxcompose.missions.engine.engine import Engine
from rbxcompose.missions.engine.task import Run, Task
from rbxcompose.missions.language.literals import HeldNode
from rbxcompose.missions.program.outcomes import Result

VERSION = 3
_CLASSES: Mapping[str, type[Any]] = {cls.__name__: cls for cls in (Place, Pose2, HeldNode, Result)}
_NUMBER = (float, int)
_POSE = {"x": _NUMBER, "y": _NUMBER, "heading": _NUMBER}
_FIELDS: Mapping[str, Mapping[str, type | tuple[type, ...]]] = {
    "Place": {"name": str, **_POSE},  # its colour is for viewers
    "Pose2": _POSE,
    "HeldNode": {"key": tuple, "text": str},
    "Result": {"success": bool, "message": str, "outcome": str, "values": dict},
}
_NUMBERS = ("nan", "inf", "-inf")  # that JSON cannot express
_LEVELS = MOST_LEVELS + 10  # of a value as plain data: a result holds values, too
_BITS = 64  # of the largest integer in a message
OF_ENGINE = ("status", "outcome", "now", "time", "lost", "is_paused", "draws", "held_until", "instant", "ticks", "wake")
OF_RUN = ("begun", "ending", "message")
_COURSE = ("lost", "left")


class NoSnapshot(ValueError):  # noqa: N818 - shown to whoever gives the data
    """Raised when data are not a snapshot of this mission."""


class NoValue(ValueError):  # noqa: N818 - shown to whoever gives the data
    """Raised when data are not a value as `to_plain` writes it."""


def save(engine: Engine) -> dict[str, Any]:
    """Return the state of an engine between two ticks, as data that JSON can hold."""
    return {
        "version": VERSION,
        "nodes": len(engine.statuses),
        "mission": engine.program.name,
        "statuses": list(engine.statuses),
        "engine": {name: to_plain(getattr(engine, name)) for name in OF_ENGINE},
        "named": sorted(engine.named),
        "stops": list(engine.stops),
        "pending": engine.debugger.pending(),
        "reads": sorted(engine.reading),
        "reasons": [[number, reason] for number, reason in sorted(engine.reasons.items())],
        "arrived": [[leaf, to_plain(result)] for leaf, result in engine.arrived],
        "kept": sorted(index for index, task in enumerate(engine.tasks) if task in engine.places.kept),
        "tasks": [_task(task, engine) for task in engine.tasks],
        "runs": [_run(run) for run in engine.runs],
    }


def restore(engine: Engine, saved: Mapping[str, Any]) -> None:
    """Restore a saved state into an engine.

    Raises:
        NoSnapshot: if the data belong to another version or mission.
    """
    if saved.get("version") != VERSION:
        raise NoSnapshot(f"a snapshot of version {saved.get('version')!r}; this is version {VERSION}")
    if saved["mission"] != engine.program.name or saved["nodes"] != len(engine.statuses):
        raise NoSnapshot(f"a snapshot of another mission than '{engine.program.name}', or of another version of it")
    engine.statuses[:] = saved["statuses"]
    for name in OF_ENGINE:
        setattr(engine, name, from_plain(saved["engine"][name]))
    engine.named, engine.reading = set(saved["named"]), set(saved["reads"])
    engine.reasons = dict(saved["reasons"])
    engine.arrived = [(leaf, from_plain(result)) for leaf, result in saved["arrived"]]
    engine.places.kept = {engine.tasks[index] for index in saved["kept"]}
    for run, state in zip(engine.runs, saved["runs"], strict=True):
        _restore_run(run, state)
    for task, state in zip(engine.tasks, saved["tasks"], strict=True):
        task.current = None if state[0] is None else engine.tasks[state[0]]
        for name, value in zip(task.saved, state[1:], strict=True):
            setattr(task, name, from_plain(value))
        task.restored()
    engine.stops[:] = saved["stops"]
    engine.debugger.take_up(saved["pending"])


def carry_on(engine: Engine) -> None:
    """Pause an engine that was restored in another process: what it requested is lost, and is requested again.

    Its next `resume` may be at any time, by any clock. Messages count as new from now on.
    """
    engine.held_until, engine.instant = None, -1.0
    engine.forget_requests()
    engine.pause(engine.now)
    for task in engine.tasks:
        if isinstance(task, Since):
            task.view.mark()
    for run in engine.runs:
        for reaction in run.reactions:
            reaction.scope.mark()


def _task(task: Task, engine: Engine) -> list[Any]:
    current = None if task.current is None else engine.index_of(task.current)
    return [current, *(to_plain(getattr(task, name)) for name in task.saved)]


def _run(run: Run) -> dict[str, Any]:
    courses = run.courses
    return {
        **{name: getattr(run, name) for name in OF_RUN},
        "data": to_plain(run.data),
        "inputs": to_plain(run.inputs),
        "stack": [courses.index(course) for course in run.stack],
        "returns": [list(leaves) for leaves in run.returns],
        "courses": [[course.current is not None, *(getattr(course, name) for name in _COURSE)] for course in courses],
        "reactions": [[reaction.is_armed, reaction.trouble, dict(reaction.scope.seen)] for reaction in run.reactions],
    }


def _restore_run(run: Run, state: Mapping[str, Any]) -> None:
    courses = run.courses
    for name in OF_RUN:
        setattr(run, name, state[name])
    for held, name in ((run.data, "data"), (run.inputs, "inputs")):
        held.clear()
        held.update(_mapping(from_plain(state[name])))
    run.stack[:] = [courses[index] for index in state["stack"]]
    run.returns[:] = [tuple(leaves) for leaves in state["returns"]]
    for course, (runs, lost, left) in zip(courses, state["courses"], strict=True):
        course.current, course.lost, course.left = course.root if runs else None, lost, left
    for reaction, (is_armed, trouble, seen) in zip(run.reactions, state["reactions"], strict=True):
        reaction.is_armed, reaction.trouble, reaction.scope.seen = is_armed, trouble, dict(seen)


def _mapping(value: Value) -> Mapping[str, Value]:
    return value if isinstance(value, Mapping) else {}


def to_plain(value: Value | NotArrived) -> Any:
    """Return a value as data for JSON; what JSON cannot express becomes a map with one entry, named after its class."""
    match value:
        case None | bool() | str() | int():
            return value
        case float():
            return value if math.isfinite(value) else {"number": str(value)}
        case list():
            return [to_plain(item) for item in value]
        case tuple():
            return {"tuple": [to_plain(item) for item in value]}
        case Mapping():
            return {"map": {str(key): to_plain(entry) for key, entry in value.items()}}
    if value is NOT_ARRIVED:
        return {"missing": True}
    name = type(value).__name__
    if name not in _CLASSES:
        raise TypeError(f"a mission cannot save a value of the type {name}")
    made: Any = value
    return {name: {field: to_plain(getattr(made, field)) for field in _FIELDS[name]}}


def from_plain(plain: Any, levels: int = _LEVELS) -> Any:
    """Return the value that `to_plain` wrote.

    Raises:
        NoValue: if it did not write this.
    """
    if levels < 0:
        raise NoValue(f"a value has more than {_LEVELS} levels")
    match plain:
        case {"number": str(text)} if text in _NUMBERS:
            return float(text)
        case {"tuple": list(items)}:
            return tuple(from_plain(item, levels - 1) for item in items)
        case {"map": dict(entries)}:
            return {key: from_plain(entry, levels - 1) for key, entry in entries.items()}
        case {"missing": True}:
            return NOT_ARRIVED
        case dict() if plain:
            return _made(*next(iter(plain.items())), levels)
        case list():
            return [from_plain(item, levels - 1) for item in plain]
        case int() if plain.bit_length() > _BITS:
            raise NoValue("a number is too large")
    return plain


def _made(name: str, entries: Any, levels: int) -> Any:
    """Return the value of a class with these fields."""
    fits = _FIELDS.get(name)
    if fits is None or not isinstance(entries, dict):
        raise NoValue(f"a value cannot be a map with the key '{plain_text(name)}'")
    values = from_plain({"map": entries}, levels - 1)
    if values.keys() != fits.keys() or not all(isinstance(values[key], fits[key]) for key in fits):
        raise NoValue(f"a value of the type '{name}' has the fields {', '.join(fits)}")
    return _CLASSES[name](**values)
