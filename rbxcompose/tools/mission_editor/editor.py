"""The missions of a robot as texts that people edit: read, checked as they are typed, and saved.

The text is the document: nothing here writes YAML anew. Only files of the robot's own project are changed, each as a
whole or not at all, and only if it is still the file that was read.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from rbxcompose.base.findings import EditPlace, Finding, Severity, Span, places_of_fixes
from rbxcompose.base.garbage_collection import paused_collection
from rbxcompose.base.requests import Refused
from rbxcompose.compiler.compile import Compilation, look_at_mission, with_text_of_mission
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.manifest.files import project_of, shown_name
from rbxcompose.missions.program.linker import link
from rbxcompose.missions.view.picture import Drawn, picture_of
from rbxcompose.tools.mission_editor.form import form, palette
from rbxcompose.tools.mission_editor.new_mission import make_mission, templates
from rbxcompose.tools.mission_editor.outline import INTERRUPTS, Block, MissionOutline, told
from rbxcompose.tools.mission_editor.patches import change, path_of
from rbxcompose.tools.mission_editor.yaml_places import TextEdit, Utf16
from rbxcompose.tools.project_texts import ProjectTexts, ReadText, hash_of, words_of

MOST_FINDINGS = 200

Compile = Callable[[Mapping[Path, str]], Compilation]


class MissionEditor:
    """Answers requests about the missions of one robot.

    `compiled` compiles it with unsaved texts, as `check` does; `simulated` does so without any real device.
    """

    def __init__(self, compiled: Compile, file: Path, simulated: Compile | None = None) -> None:
        self._compiled, self._simulated = compiled, simulated or compiled
        self._file = file.resolve()
        self._project = project_of(self._file)
        self._texts = ProjectTexts(self._project)
        self._robot: Robot | None = None

    def answer(self, request: Mapping[str, Any]) -> Any:
        """Return the answer to a request: its `do`, the name of a `mission`, and what else it needs.

        Raises:
            Refused: with the reason.
        """
        return REQUESTS[request["do"]](self, request)

    # What a page asks

    def _list(self, request: Mapping[str, Any]) -> list[str]:
        """Return the names of the missions that the robot has on disk; not all need be in the one that runs."""
        self._compile({})
        return [*self._known.manifest.missions]

    def _read(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Return the text of a mission with what is wrong with it."""
        name = request["mission"]
        self._compile({})
        read = self._read_file(name)
        shown = {"file": self._texts.shown(read.path), "text": read.text, "hash": read.hash}
        return {**shown, "why_not": self._texts.why_not(read.path), **self._looked_at(name, read.text)}

    def _look(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Return what is wrong with a text, as far as that is known at once."""
        return self._looked_at(request["mission"], request["text"])

    def _edit(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Return how a change of the outline changes the text, and the block that is chosen afterwards."""
        text, units = request["text"], Utf16(request["text"])
        with paused_collection():
            made = change(text, request["operation"])
        return {"edits": _edits_as_data(made.edits, units), "chosen": list(made.chosen)}

    def _palette(self, request: Mapping[str, Any]) -> list[dict[str, str]]:
        """Return what can be put into a mission of this robot."""
        return palette(self._known, self._path(request["mission"]))

    def _form(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Return the values of a block, and what they can be."""
        path = path_of(request["path"])
        return form(self._known, self._path(request["mission"]), request["text"], path)

    def _templates(self, request: Mapping[str, Any]) -> list[dict[str, str]]:
        """Return the templates of new missions."""
        return templates()

    def _new(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Write a new mission from a template into the project, and into the robot's file."""
        self._compile({})
        name, template = request["mission"], request["template"]
        path = make_mission(self._known, self._file, self._project, name, template, self._compiled)
        self._compile({})
        return {"file": self._texts.shown(path)}

    def _try(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Run a text on the simulated robot, and return what came of it."""
        from rbxcompose.tools.mission_editor.dry_run import dry_run

        path, text = self._path(request["mission"]), request["text"]
        return dry_run(self._simulated({path: text}), request["mission"], path, text)

    def _test(self, request: Mapping[str, Any]) -> Any:
        """Run the tests of a mission with a text in place of its file."""
        from rbxcompose.tools.mission_editor.dry_run import run_tests

        path = self._path(request["mission"])
        unsaved = {} if self._read_file(request["mission"]).text == request["text"] else {path: request["text"]}
        return json.loads(run_tests(self._project, request["mission"], unsaved))

    def _aloud(self, request: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Return what a text says, in sentences."""
        path = self._path(request["mission"])
        with paused_collection():
            return read_aloud(self._known, request["mission"], path, request["text"])

    def _test_new(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Write a test of a mission as it is on disk, from a dry run."""
        from rbxcompose.tools.mission_editor.dry_run import make_test, tried

        mission = request["mission"]
        self._path(mission)
        record = tried(self._simulated({}), mission)[0]
        return {"file": self._texts.shown(make_test(self._texts.project, self._file, mission, record))}

    def _check(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Return all that `check` finds with a text in place of a mission's file."""
        path = self._path(request["mission"])
        made = self._compile({path: request["text"]}, keeps=False)
        return self._told(path, request["text"], made.report)

    def _save(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Write a text into a mission's file, or with `dry_run` only show the difference."""
        name, text = request["mission"], request["text"]
        read = self._read_file(name)
        self._texts.require_unchanged(read, request["hash"])
        data = read.encoded(text)
        if request.get("dry_run") is True:
            return {"diff": read.difference(text), **self._check(request)}
        self._texts.replace(read.path, data)
        self._compile({})
        return {"hash": hash_of(data), "file": self._texts.shown(read.path)}

    # How it is done

    def _compile(self, unsaved: Mapping[Path, str], *, keeps: bool = True) -> Compilation:
        """Compile the robot; keep it, if its missions are still known, for what is asked next."""
        made = self._compiled(unsaved)
        if keeps and made.robot is not None:
            self._robot = made.robot
        return made

    @property
    def _known(self) -> Robot:
        if self._robot is None:
            self._compile({})
        if self._robot is None:
            raise Refused("the robot's file cannot be read: 'rbxcompose check' tells why")
        return self._robot

    def _path(self, mission: str) -> Path:
        if mission not in self._known.manifest.missions:
            self._compile({})  # another process may have made it
        entry = self._known.manifest.missions.get(mission)
        if entry is None:
            raise Refused(f"the robot has no mission '{mission[:60]}'")
        return entry.path

    def _read_file(self, mission: str) -> ReadText:
        return self._texts.read(self._path(mission))

    def _looked_at(self, mission: str, text: str) -> dict[str, Any]:
        path = self._path(mission)
        report, _ = look_at_mission(self._known, mission, os.environ, {path: text})
        with paused_collection():
            outline = MissionOutline(text)
        return {**self._told(path, text, report), "outline": told(outline, Utf16(text).at)}

    def _told(self, path: Path, text: str, report: Any) -> dict[str, Any]:
        """Return findings as data: those of the text with their offsets and fixes, others with their places."""
        units, shown = Utf16(text), shown_name(path)
        found = sorted(report, key=lambda one: (one.span is None, one.span or ()))
        own = [one for one in found if one.span is not None and one.span.file == shown]
        others = [one for one in found if one.span is None or one.span.file != shown]
        fixes = [one.fix for one in own if one.fix is not None]
        applied = dict(zip(map(id, fixes), places_of_fixes(fixes, {shown: text}), strict=True))
        findings = [self._finding(one, units) for one in own[:MOST_FINDINGS]]
        for data, one in zip(findings, own, strict=False):
            if one.fix is not None and (edits := applied[id(one.fix)]):
                moved = [edit for edit in edits if not edit.is_guard]
                data["fix"] = {"title": one.fix.title, "edits": _edits_as_data(moved, units)}
        errors = sum(one.severity is Severity.ERROR for one in own)
        elsewhere = [{**words_of(one), "place": str(one.span or "")} for one in others[:MOST_FINDINGS]]
        return {"findings": findings, "errors": errors, "count": len(own), "elsewhere": elsewhere}

    def _finding(self, finding: Finding, units: Utf16) -> dict[str, Any]:
        span = finding.span or Span("", 1, 1, 1, 1)
        start, end = units.offset(span.line, span.column), units.offset(span.end_line, span.end_column)
        return {**words_of(finding), "from": start, "to": max(start, end), "line": span.line, "fix": None}


def _edits_as_data(edits: Iterable[TextEdit | EditPlace], units: Utf16) -> list[dict[str, Any]]:
    return [{"from": units.at(edit.start), "to": units.at(edit.end), "text": edit.text} for edit in edits]


REQUESTS: Mapping[str, Callable[[MissionEditor, Mapping[str, Any]], Any]] = MappingProxyType(
    {
        "aloud": MissionEditor._aloud,
        "check": MissionEditor._check,
        "edit": MissionEditor._edit,
        "form": MissionEditor._form,
        "list": MissionEditor._list,
        "look": MissionEditor._look,
        "new": MissionEditor._new,
        "palette": MissionEditor._palette,
        "read": MissionEditor._read,
        "save": MissionEditor._save,
        "templates": MissionEditor._templates,
        "test": MissionEditor._test,
        "test_new": MissionEditor._test_new,
        "try": MissionEditor._try,
    }
)


def read_aloud(robot: Robot, mission: str, path: Path, text: str) -> list[dict[str, Any]]:
    """Return the sentences of a text as `mission show` has them: `place`, what it says, and the `path` of its block.

    That is None for what another mission says.

    Raises:
        Refused: if the text has mistakes.
    """
    changed, report, _ = with_text_of_mission(robot, mission, os.environ, {path: text})
    errors = [one for one in report if one.severity is Severity.ERROR]
    if changed is None or errors:
        raise Refused(f"it cannot be read aloud yet: {errors[0].message}" if errors else "it cannot be read aloud yet")
    program, names = changed.missions[mission].program, changed.names
    picture, linked = picture_of(program, names), link(program, names.missions)
    outline, file = MissionOutline(text), shown_name(path)

    def written(drawn: Drawn) -> Block | None:
        if drawn.number is None:
            return outline.at((INTERRUPTS, drawn.name))
        span = linked.nodes[drawn.number].span
        return outline.written_at(span.line, span.column) if span.file == file else None

    def block_of(drawn: Drawn) -> Block | None:
        block = written(drawn)
        if block is None or not drawn.children or written(drawn.children[0]) is not block:
            return block
        return outline.at(block.path[:-1])  # a list begins where its first step does

    return [
        {
            "place": drawn.place,
            "text": f"{drawn.sentence}{':' if drawn.children else ''}",
            "path": list(block.path) if (block := block_of(drawn)) is not None else None,
        }
        for root in picture.roots
        for drawn in root.all()
    ]
