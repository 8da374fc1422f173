"""Live values written into the files of a robot, each at its place: all of them, or nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from rbxcompose.atomic_files import replace_file
from rbxcompose.cli.robots.live_settings import LiveChange, LiveSettings
from rbxcompose.cli.robots.lookup import NotDoneError, answer_of
from rbxcompose.compiler import Compilation
from rbxcompose.composition.value_edits import UnsavableError, edit_of, is_same, merged
from rbxcompose.config import Config, key_of, value_at, with_values
from rbxcompose.dataclass import dataclass
from rbxcompose.edits import apply
from rbxcompose.findings import Finding, Fix, Related, kind
from rbxcompose.manifest.limits import FILE_BYTES
from rbxcompose.msgs.rbxcompose_parameters import ParameterChange
from rbxcompose.params.values import from_message
from rbxcompose.plan.diff import Difference, difference
from rbxcompose.plan.dump import dump
from rbxcompose.plan.model import Plan
from rbxcompose.regular_files import read_regular
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.plan_requests import ComparePlan

NOT_SAVED = kind("RBX9044")
CHANGED_SINCE = kind("RBX9045")
Compiled = Callable[[Mapping[Path, str]], Compilation]
_COMPARE = 10.0  # [s] for the supervisor to read a plan


@dataclass(frozen=True, slots=True)
class NewTexts:
    """What is to be written: the texts of files before and after, by path; the edits with their places."""

    before: Mapping[Path, bytes]
    after: Mapping[Path, bytes]
    fix: Fix


def files_with(live: LiveSettings, changes: Sequence[LiveChange], compiled: Compiled) -> NewTexts:
    """Return the files of a robot with values written into them; `compiled` returns the robot with other texts.

    Raises:
        NotDoneError: if one of the values cannot be written, or something else would change by it.
    """
    edits = []
    for change in changes:
        path = live.robot.components[change.component].place(key_of(live.now[change.component], change.name))
        try:
            edits.append(edit_of(live.robot.manifest, live.sources, path, change.live, change.dimension))
        except UnsavableError as error:
            raise NotDoneError(_unsavable(change, error)) from error
    try:
        fix = merged(edits)
    except UnsavableError as error:
        raise NotDoneError(NOT_SAVED.at(error.span, f"nothing is saved: {error.reason}")) from error
    texts = _edited(live, fix)
    _require_nothing_else(live, changes, texts, compiled)
    return texts


def write(texts: NewTexts) -> None:
    """Write all files; if one cannot be written, those before it are what they were.

    Raises:
        NotDoneError: if one cannot be written.
    """
    done: list[Path] = []
    for path, data in texts.after.items():
        try:
            if read_regular(path, FILE_BYTES) != texts.before[path]:
                raise OSError(None, "it has changed meanwhile")
            replace_file(path, data)
        except OSError as error:
            for one in done:
                replace_file(one, texts.before[one])
            raise NotDoneError(NOT_SAVED.at(None, f"nothing is saved: '{path}': {error.strerror}")) from error
        done.append(path)


def require_unedited(
    live: LiveSettings, changes: Iterable[LiveChange], folder: RobotFolder, history: Sequence[ParameterChange]
) -> None:
    """Refuse to save values whose places in the files say something that the robot has never had.

    Raises:
        NotDoneError: if there is one.
    """
    edited = _keys_changed(live.plan, folder)
    for change in changes:
        if change.path in edited and not any(is_same(one, change.written) for one in _values(history, change.path)):
            span = live.robot.value(*live.robot.components[change.component].place(change.name))
            was, now = edited[change.path]
            message = f"'{change.path}' is {now} in the file now; the robot came up with {was}"
            raise NotDoneError(CHANGED_SINCE.at(span, message, help="'rbxcompose param reset' takes over the file"))


def changed_since_up(live: LiveSettings, folder: RobotFolder, history: Sequence[ParameterChange]) -> list[LiveChange]:
    """Return what is not as in the files because somebody has set it, not because a file was edited."""
    found = list(live.changes)
    if not found:
        return []
    kept = _keys_changed(live.plan_with(live.now), folder).keys() | {f"{one.component}.{one.name}" for one in history}
    return [one for one in found if one.path in kept]


def _values(history: Iterable[ParameterChange], path: str) -> Iterator[object]:
    for one in history:
        if f"{one.component}.{one.name}" == path:
            yield from (from_message(one.before), from_message(one.after))


def _keys_changed(plan: Plan, folder: RobotFolder) -> dict[str, tuple[str, str]]:
    """Return the settings in which a plan differs from that of the running robot, with both values in words."""
    text = dump(plan, reveals_secrets=True)  # the socket is this user's alone
    found = answer_of(folder, ComparePlan(text), timeout=_COMPARE)
    each = ((one.name, reason) for one in found.components for reason in one.reasons)
    return {f"{name}.{one.key}": (one.before or "nothing", one.after or "nothing") for name, one in each}


def _unsavable(change: LiveChange, error: UnsavableError) -> Finding:
    return NOT_SAVED.at(error.span, f"'{change.path}' cannot be saved: {error.reason}", help=error.help)


def _edited(live: LiveSettings, fix: Fix) -> NewTexts:
    files = live.robot.manifest.files
    before = {}
    for shown in dict.fromkeys(edit.span.file for edit in fix.edits):
        data = read_regular(files[shown], FILE_BYTES)
        if data.decode("utf-8-sig").replace("\r\n", "\n") != live.sources[shown]:
            raise NotDoneError(NOT_SAVED.at(None, f"nothing is saved: '{shown}' has changed meanwhile"))
        before[shown] = data
    texts = {shown: data.decode("utf-8") for shown, data in before.items()}
    ends = {shown: "\r\n" if "\r\n" in text else "\n" for shown, text in texts.items()}
    edits = (replace(one, text=one.text.replace("\n", ends[one.span.file])) for one in fix.edits)
    out = apply([replace(fix, edits=tuple(edits))], texts)
    if not out.done:
        raise NotDoneError(NOT_SAVED.at(None, "nothing is saved: the values are written in an unusual way"))
    after = {files[shown]: text.encode("utf-8") for shown, text in out.texts.items() if text != texts[shown]}
    return NewTexts({files[shown]: data for shown, data in before.items()}, after, fix)


def _require_nothing_else(
    live: LiveSettings, changes: Sequence[LiveChange], texts: NewTexts, compiled: Compiled
) -> None:
    """Compile what would be written: it must say the new values, and nothing else may be another one."""
    unsaved = {path: data.decode("utf-8") for path, data in texts.after.items()}
    found = compiled(unsaved)
    if found.plan is None or found.robot is None:
        error = next(one for one in found.report if one.severity == "error")
        related = (Related(error.span, "here"),) if error.span else ()
        message = f"nothing is saved: the files would be wrong: {error.message} ({error.code})"
        raise NotDoneError(NOT_SAVED.at(None, message, help=error.help, related=related))
    wanted: dict[str, Config] = {}
    for one in changes:
        config = wanted.get(one.component, live.robot.components[one.component].config)
        said = value_at(found.robot.components[one.component].config, one.name)
        wanted[one.component] = with_values(config, {one.name: said if is_same(said, one.live) else one.live})
    side_effects = difference(live.plan_with(wanted), found.plan)
    if not side_effects.is_empty:
        message = f"nothing is saved: {_told(side_effects)} would change, too, which is written at the same place"
        help_text = "set that as well, or write the value into the component by hand"
        raise NotDoneError(NOT_SAVED.at(texts.fix.edits[0].span, message, help=help_text))


def _told(found: Difference) -> str:
    keys = [f"{name}.{one.key}" for name, each in found.changed.items() for one in each]
    keys += [one.key for one in found.plan]
    return ", ".join(f"'{key}'" for key in keys) or "the robot"
