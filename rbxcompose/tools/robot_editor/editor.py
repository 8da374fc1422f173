"""The robot as it is edited on the page: places, muxes and parts, each change an edit of the text that says it.

A page sends what it wants to change as a list, always from the beginning: what is on disk is the document, and undo is
a shorter list. Each change is made in the file where the value stands, the robot is compiled with it, and it is refused
if anything else would change with it. Files are saved together or not at all, if all of them are as they were read. The
robot that runs is changed to what its files say by `apply`, and back again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Severity, Span
from rbxcompose.base.requests import Refused
from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.lookup import answer_of
from rbxcompose.compiler.compile import Compilation
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.manifest.files import project_of
from rbxcompose.manifest.tree import KeyPath
from rbxcompose.runtime.folder import ChosenLayers, RobotFolder
from rbxcompose.runtime.plan_requests import RevertPlan
from rbxcompose.tools.mission_editor.yaml_places import Path as TextPath
from rbxcompose.tools.project_texts import ProjectTexts, ReadText, words_of
from rbxcompose.tools.robot_changes import LONGEST_CHANGE, Proposal
from rbxcompose.tools.robot_editor.map_patches import MapPatch, entry_at, file_of, value_at
from rbxcompose.tools.robot_editor.parts import IncludedParts, OfferedPart, offered_parts
from rbxcompose.tools.robot_editor.subjects import Muxes, Places, Subject

MOST_CHANGES = 100
MOST_FINDINGS = 200

Compile = Callable[[Mapping[Path, str]], Compilation]
RobotChange = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class EditedRobot:
    """A robot with some changes: the texts that are others than on disk, and what came of them."""

    texts: Mapping[Path, str]
    made: Compilation

    @property
    def robot(self) -> Robot:
        """Return the robot.

        Raises:
            Refused: if it cannot be read at all.
        """
        if self.made.robot is None:
            why = next((one.message for one in self.made.report if one.severity is Severity.ERROR), "unknown")
            raise Refused(f"the robot cannot be read: {why}")
        return self.made.robot


class RobotEditor:
    """Answers requests about one robot; `shared_with` are others of its system that have the same manifest."""

    def __init__(self, compiled: Compile, file: Path, shared_with: Sequence[str] = ()) -> None:
        self._compiled, self._file = compiled, file.resolve()
        self._shared_with = tuple(shared_with)
        self._texts = ProjectTexts(project_of(self._file))
        self._read: dict[Path, ReadText] = {}
        self._states: list[tuple[str, EditedRobot]] = []  # after each change of the last list, itself as JSON

    def answer(self, request: Mapping[str, Any]) -> Any:
        """Return the answer to a request: its `do`, a `subject`, a list of `changes`, and what else it needs.

        Raises:
            Refused: with the reason.
        """
        return ROBOT_REQUESTS[request["do"].removeprefix(PREFIX)](self, request)

    # What a page asks

    def _look(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Return the robot with some changes, what is wrong with it, and the hashes of its files."""
        subject, changes = _subject(request), _changes(request)
        self._require(request, is_new=not changes)
        before, after = self._states[0][1], self._changed(changes)
        files = self._files(before.robot)
        return {
            "hashes": {self._texts.shown(path): read.hash for path, read in files.items()},
            "why_not": self._why_not(self._file),
            "file": self._texts.shown(self._file),
            "entries": subject.entries(after.robot, lambda path: self._where(after, path)),
            **subject.surroundings(before.robot, after.robot),
            **self._told(before, after),
        }

    def _palette(self, request: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Return the parts that can be included."""
        return [{key: getattr(one, key) for key in OfferedPart.__slots__} for one in offered_parts(self._file)]

    def _save(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Write the changes into their files, or with `dry_run` only show the difference."""
        _subject(request)
        changes = _changes(request)
        self._require(request, is_new=True)  # missions may have changed since
        before, after = self._states[0][1], self._changed(changes)
        texts = {path: text for path, text in after.texts.items() if text != self._read[path].text}
        if request.get("dry_run") is True:
            diffs = [self._difference(path, text) for path, text in texts.items()]
            return {"diff": [line for diff in diffs for line in diff], **self._told(before, after)}
        data = {path: self._read[path].encoded(text) for path, text in texts.items()}
        done: list[Path] = []
        try:
            for path, new in data.items():
                self._texts.require_unchanged(self._texts.read(path), self._read[path].hash)
                self._texts.replace(path, new)
                done.append(path)
        except Refused as refusal:
            for path in done:
                self._texts.replace(path, self._read[path].encoded(self._read[path].text))
            raise refusal
        self._states.clear()
        return {"files": [self._texts.shown(path) for path in data]}

    # How it is done

    def _require(self, request: Mapping[str, Any], *, is_new: bool) -> None:
        """Read the robot if need be, and refuse files that are others than those which the page has seen.

        Raises:
            Refused: with the reason.
        """
        if is_new or not self._states or self._has_changed():
            self._read.clear()
            self._states = [("", EditedRobot({}, self._compiled({})))]
        known = request.get("hashes") or {}
        for path, read in self._files(self._states[0][1].robot).items():
            shown = self._texts.shown(path)
            if known and known.get(shown) != read.hash:
                raise Refused(f"'{shown}' has changed on disk since it was opened: load it again")

    def _has_changed(self) -> bool:
        with suppress(Refused):
            return any(self._texts.read(path).hash != read.hash for path, read in self._read.items())
        return True

    def _files(self, robot: Robot) -> Mapping[Path, ReadText]:
        """Return the files of the project that say what the robot is."""
        for path in {self._file, *robot.manifest.files.values()}:
            if path.is_relative_to(self._texts.project) and path not in self._read:
                self._read[path] = self._texts.read(path)
        return self._read

    def _changed(self, changes: Sequence[RobotChange]) -> EditedRobot:
        """Return the robot with changes; what is known of the first of them is not compiled again."""
        keys = ["", *(json.dumps(change, sort_keys=True) for change in changes)]
        same = 0
        while same < min(len(keys), len(self._states)) and keys[same] == self._states[same][0]:
            same += 1
        del self._states[same:]
        for key, change in zip(keys[same:], changes[same - 1 :], strict=True):
            self._states.append((key, self._after(self._states[-1][1], change)))
        return self._states[-1][1]

    def _after(self, state: EditedRobot, change: RobotChange) -> EditedRobot:
        """Return the robot after one more change."""
        if why := self._why_shared():
            raise Refused(why)
        subject, path, texts = SUBJECTS[change["subject"]], tuple(change["path"]), dict(state.texts)
        if change["op"] not in subject.operations:
            raise Refused(f"of {subject.what}, only values can be changed here: change it in the file")
        for file, changed in self._patches(state, subject, path, change):
            text = self._text(state, file) if file not in texts else texts[file]
            patch = MapPatch(text)
            changed(patch)
            texts[file] = patch.done().applied(text)
        made = EditedRobot(texts, self._compiled(texts))
        _require_meant(subject, state.robot, made.robot, change)
        return made

    def _patches(
        self, state: EditedRobot, subject: Subject, path: KeyPath, change: RobotChange
    ) -> list[tuple[Path, Callable[[MapPatch], None]]]:
        """Return which files a change changes, and how, one after the other."""
        op, manifest = change["op"], state.robot.manifest
        if op == "add":
            name, value = subject.new_entry(state.robot, path, {**change, "file": str(self._file)})
            self._require_writable(self._file)
            return [(self._file, lambda patch: patch.add(path[:1], name, value))]
        if op == "set":
            maps: dict[tuple[Path, TextPath], dict[str, str]] = {}
            for keys, value in subject.written(state.robot, path, change).items():
                file, place, key = value_at(manifest, (*path, *keys), lambda one: self._text(state, one))
                self._require_writable(file)
                maps.setdefault((file, place), {})[key] = value
            return [(file, partial(MapPatch.set, path=place, values=values)) for (file, place), values in maps.items()]
        file, place = entry_at(manifest, path, lambda one: self._text(state, one))
        self._require_writable(file)
        if op == "remove":
            return [(file, lambda patch: patch.remove(place))]
        new_name = subject.new_name(state.robot, path, str(place[-1]), change)
        return [(file, lambda patch: patch.rename(place, new_name))]

    def _where(self, state: EditedRobot, path: KeyPath) -> dict[str, Any]:
        """Return where an entry stands, and why it cannot be changed, if it cannot."""
        file = file_of(state.robot.manifest, path)
        shown = self._texts.shown(file) if file is not None else ""
        try:
            found, _ = entry_at(state.robot.manifest, path, lambda one: self._text(state, one))
            return {"file": shown, "why_not": self._why_not(found)}
        except Refused as refusal:
            return {"file": shown, "why_not": str(refusal)}

    def _text(self, state: EditedRobot, file: Path) -> str:
        if (text := state.texts.get(file)) is not None:
            return text
        if file not in self._read:
            self._require_writable(file)
            self._read[file] = self._texts.read(file)
        return self._read[file].text

    def _why_shared(self) -> str:
        if not self._shared_with:
            return ""
        others = ", ".join(f"'{name}'" for name in self._shared_with)
        shown = self._texts.shown(self._file)
        return f"'{shown}' is the manifest of {others}, too, which would change with it: change it in the file"

    def _why_not(self, file: Path) -> str:
        return self._why_shared() or self._texts.why_not(file)

    def _require_writable(self, file: Path) -> None:
        if why := self._why_not(file):
            raise Refused(why)

    def _told(self, before: EditedRobot, after: EditedRobot) -> dict[str, Any]:
        """Return findings, those first that the changes have brought."""
        known = {(one.code, one.message) for one in before.made.report}
        found = [(one, (one.code, one.message) not in known) for one in after.made.report]
        found.sort(key=lambda pair: (not pair[1], pair[0].severity is not Severity.ERROR))
        told = [{**words_of(one), "place": self._place(one.span), "is_new": is_new} for one, is_new in found]
        errors = sum(one.severity is Severity.ERROR for one, _ in found)
        return {"findings": told[:MOST_FINDINGS], "errors": errors, "count": len(found)}

    def _place(self, span: Span | None) -> str:
        if span is None:
            return ""
        file = self._texts.shown(Path(span.file)) if Path(span.file).is_absolute() else span.file
        return f"{file}:{span.line}:{span.column}"

    def _difference(self, path: Path, text: str) -> list[str]:
        return [f"@@ {self._texts.shown(path)} @@", *self._read[path].difference(text)]


PREFIX = "robot/"
ROBOT_REQUESTS: Mapping[str, Callable[[RobotEditor, Mapping[str, Any]], Any]] = MappingProxyType(
    {"look": RobotEditor._look, "palette": RobotEditor._palette, "save": RobotEditor._save}
)
SUBJECTS: Mapping[str, Subject] = MappingProxyType(
    {subject.section: subject for subject in (Places(), Muxes(), IncludedParts())}
)


def _require_meant(subject: Subject, before: Robot, after: Robot, change: RobotChange) -> None:
    """Refuse a change that has another effect than the one that was meant.

    Raises:
        Refused: with what else would change.
    """
    name = change["path"][1]
    wanted = change.get("name", name)
    for other in SUBJECTS.values() if subject.is_alone else (subject,):
        old, new = other.state(before), other.state(after)
        own = {name, wanted} if other is subject else set()
        also = [key for key in (*old, *new) if old.get(key) != new.get(key) and key not in own]
        if also:
            raise Refused(f"this would change '{also[0]}', too: they are written in the same place")
    if (change["op"] == "remove") == (wanted in subject.state(after)):
        raise Refused(f"'{wanted}' would not be what was meant: another layer says it, too")


def _subject(request: Mapping[str, Any]) -> Subject:
    found = SUBJECTS.get(request.get("subject", ""))
    if found is None:
        raise Refused("this cannot be edited here")
    return found


def _changes(request: Mapping[str, Any]) -> list[RobotChange]:
    """Return the changes of a request, each with its subject.

    Raises:
        Refused: if they are none.
    """
    changes, subject = request.get("changes"), request["subject"]
    if not isinstance(changes, list) or not all(_is_change(one, subject) for one in changes):
        raise Refused("this is no change of a robot")
    if len(changes) > MOST_CHANGES:
        raise Refused(f"these are more than {MOST_CHANGES} changes: save them first")
    return [{**one, "subject": subject} for one in changes]


def _is_change(change: Any, section: str) -> bool:
    if not isinstance(change, dict) or change.get("op") not in ("add", "set", "rename", "remove"):
        return False
    path = change.get("path")
    return isinstance(path, list) and len(path) == 2 and isinstance(path[1], str) and path[0] == section


class LiveRobot:
    """Answers what a page asks about the robot that runs.

    `compiled` compiles it with the `layers` that it has, and as a member of its system.
    """

    def __init__(self, folder: RobotFolder, compiled: Callable[[], Compilation], layers: ChosenLayers) -> None:
        self._folder, self._compiled, self._layers = folder, compiled, layers

    def answer(self, request: Mapping[str, Any]) -> Any:
        """Return the answer to a request: its `do`, and the `generation` of the plan that a person has seen.

        Raises:
            Refused: with the reason.
        """
        try:
            return LIVE_REQUESTS[request["do"]](self, request)
        except NotDoneError as error:
            raise Refused(error.finding.message) from error

    def _compare(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Return what would change in the robot that runs, and what prevents it."""
        proposal = self._proposal()
        changed = [one for one in proposal.data["components"] if one["fate"] != "kept"]
        return {
            "generation": proposal.found.generation,
            "is_empty": proposal.is_empty,
            "why_not": proposal.why_not,
            "components": [{key: one[key] for key in ("name", "fate", "reasons")} for one in changed],
            "said": list(proposal.found.said),
        }

    def _apply(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Change the robot that runs to what its files say, if it is still the one that was compared."""
        proposal = self._proposal()
        if proposal.found.generation != request["generation"]:
            raise Refused("the robot was changed by someone else meanwhile: look at the difference again")
        if proposal.why_not:
            raise Refused(proposal.why_not)
        return {"text": proposal.apply(), "generation": proposal.found.generation}

    def _revert(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Take a change back; the files stay as they are."""
        return {"text": answer_of(self._folder, RevertPlan(request["generation"]), timeout=LONGEST_CHANGE)}

    def _proposal(self) -> Proposal:
        made = self._compiled()
        if made.plan is None or made.robot is None:
            found = [one for one in made.report if one.severity is Severity.ERROR]
            errors = "1 error" if len(found) == 1 else f"{len(found)} errors, the first"
            raise Refused(f"its files have {errors}: {found[0].message}")
        proposal = Proposal.of(made.plan, made.robot, self._layers)
        if self._layers.system and proposal.found.shares_change:
            raise Refused(f"what robots share would change, so all change together: {applied(self._layers)}")
        return proposal


def applied(layers: ChosenLayers) -> str:
    """Return the command that changes the system of a robot."""
    return f"'rbxcompose apply {layers.system}'"


LIVE_REQUESTS: Mapping[str, Callable[[LiveRobot, Mapping[str, Any]], Any]] = MappingProxyType(
    {"robot/compare": LiveRobot._compare, "robot/apply": LiveRobot._apply, "robot/revert": LiveRobot._revert}
)
