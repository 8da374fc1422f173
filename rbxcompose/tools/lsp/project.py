"""The robots that an editor works on: compiled with the texts as they are being typed."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import field
from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Report
from rbxcompose.commands.targets import Targets, robots_below
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.composition.robot_file import read_mission
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.schema.documents import installed_schema
from rbxcompose.manifest.files import ROBOT_FILE, project_of, shown_name
from rbxcompose.manifest.reader import Texts, read_file
from rbxcompose.manifest.section import OVERLAY, ROBOT, SYSTEM, TEST
from rbxcompose.missions.language.reader import read_program
from rbxcompose.msgs import registry

MISSION = "Mission"
_USERS = (TEST, SYSTEM)  # kinds that use robots, and that nothing uses: they are checked while they are open
_KIND = re.compile(r"^kind:[ ]*[\"']?(\w+)", re.MULTILINE)
_HEADER = re.compile(r"^rbx:", re.MULTILINE)
_MOST_ROBOTS = 200  # examined per project
_BEGINNING = 4_000  # characters that contain the header of a manifest

FoundByFile = dict[Path, list[Finding]]
PAUSE = 0.1  # [s] without a keystroke before robots are compiled again


class OutdatedError(Exception):
    """Raised when a project is compiled whose texts have changed since."""


def kind_of(text: str) -> str:
    """Return the kind that a manifest declares, or nothing."""
    match = _KIND.search(text[:_BEGINNING])
    return match[1] if match else ""


@dataclass(slots=True)
class _Watched:
    """What was compiled, by its kind: the newest findings and files, and the last robot that could be read."""

    kind: str
    report: Report
    files: frozenset[Path]
    robot: Robot | None


@dataclass(slots=True)
class Project:
    """All open texts, and the robots, tests and systems that they are part of."""

    environment: Mapping[str, str]
    unsaved: dict[Path, str] = field(default_factory=dict)
    is_outdated: Callable[[], bool] = lambda: False
    _watched: dict[Path, _Watched] = field(default_factory=dict)
    _alone: FoundByFile = field(default_factory=dict)  # findings in files that belong to no robot

    def copy(self, is_outdated: Callable[[], bool]) -> Project:
        """Return a project that changes independently of this one; it raises `OutdatedError` once it is outdated."""
        return Project(self.environment, dict(self.unsaved), is_outdated, dict(self._watched), dict(self._alone))

    def has(self, path: Path, text: str) -> bool:
        """Return whether a text is a manifest: editors send every YAML file."""
        return _HEADER.search(text[:_BEGINNING]) is not None or bool(self._concerned(path))

    def text(self, path: Path) -> str:
        """Return the text of a file from the editor, else the saved one; empty if it cannot be read."""
        if path in self.unsaved:
            return self.unsaved[path]
        sources: dict[str, str] = {}
        read_file(path, str(path), sources)
        return sources.get(str(path), "")

    @property
    def known(self) -> set[Path]:
        """Return the open files, and all that was compiled."""
        return {*self.unsaved, *self._watched}

    def change(self, path: Path, text: str | None) -> FoundByFile:
        """Take one new text in the way of `change_all`."""
        return self.change_all({path: text})

    def change_all(self, texts: Mapping[Path, str | None]) -> FoundByFile:
        """Take new texts (None: the saved one counts again) and return the findings of all files concerned.

        A file without findings has an empty list, so that its old findings are cleared.

        Raises:
            OutdatedError: if the project has become outdated; it must not be used any more.
        """
        self.unsaved = {path: text for path, text in {**self.unsaved, **texts}.items() if text is not None}
        files = {*texts, *self._files(robot for path in texts for robot in self._concerned(path))}
        for path in texts.keys() & self._watched.keys() - self.unsaved.keys():
            if self._watched[path].kind in _USERS or not path.exists():
                del self._watched[path]
        robots = dict.fromkeys(robot for path in texts for robot in self._robots_of(path))
        for robot in robots:
            self._compile(robot)
        files.update(self._files(robots))
        for file in files:
            self._alone.pop(file, None)
            if file in self.unsaved and not self._concerned(file):  # where would an editor show what is wrong with it?
                self._alone[file] = self._lone_findings(file)
        return {file: self.findings(file) for file in sorted(files)}

    def findings(self, path: Path) -> list[Finding]:
        """Return the known findings in a file, from all robots."""
        found = [finding for robot in self._watched for finding in self._of(robot, path)]
        return list(dict.fromkeys([*found, *self._alone.get(path, ())]))

    def robot_of(self, path: Path) -> Robot | None:
        """Return a robot that a file belongs to, as last read successfully; None before it was compiled.

        Names of message types mean those of this robot from then on.
        """
        robots = self._concerned(path)
        if not robots and (base := self._base_of(path)):
            robots = self._concerned(base)
        found = next((robot for one in robots if one in self._watched and (robot := self._watched[one].robot)), None)
        registry.choose(found.manifest.messages if found else {})
        return found

    def _base_of(self, path: Path) -> Path | None:
        """Return the robot that an overlay is assumed to belong to: the one beside it."""
        robot = path.parent / ROBOT_FILE
        return robot if kind_of(self.text(path)) == OVERLAY and robot.is_file() else None

    def _files(self, robots: Iterable[Path]) -> Iterator[Path]:
        return (file for robot in robots for file in self._watched[robot].files)

    def _of(self, robot: Path, path: Path) -> Iterator[Finding]:
        for finding in self._watched[robot].report:
            place = Path(finding.span.file).resolve() if finding.span else robot
            if place == path:
                yield finding

    def _concerned(self, path: Path) -> list[Path]:
        """Return what a file is part of, robots first: these have no profile."""
        found = [robot for robot, watched in self._watched.items() if path in watched.files]
        return sorted(found, key=lambda one: self._watched[one].kind in _USERS)

    def _robots_of(self, path: Path) -> list[Path]:
        """Return what a file is part of: itself, the robots of its project that use it, and open tests and systems."""
        kind = kind_of(self.text(path))
        if path in self._watched or kind == ROBOT or (kind in _USERS and path in self.unsaved):
            return list(dict.fromkeys([path, *self._concerned(path)]))
        below = robots_below(project_of(path))[:_MOST_ROBOTS] if kind not in _USERS else []
        for robot in (Path(shown).resolve() for shown in below):
            if robot not in self._watched and kind_of(self.text(robot)) == ROBOT:
                self._compile(robot)
        return self._concerned(path)

    def _compile(self, path: Path) -> None:
        if self.is_outdated():
            raise OutdatedError
        before, kind = self._watched.get(path), kind_of(self.text(path))
        if before and kind not in (ROBOT, *_USERS):  # one that is being typed
            kind = before.kind
        report, sources, robot = self._compiled(path, kind)
        files = frozenset({path, *(Path(shown).resolve() for shown in sources)})
        # While a text cannot be read, the names of the last readable robot serve best.
        self._watched[path] = _Watched(kind, report, files, robot or (before.robot if before else None))

    def _compiled(self, path: Path, kind: str) -> tuple[Report, Mapping[str, str], Robot | None]:
        """Return the findings of a robot, test or system, the texts of its files, and its robot (none of a system)."""
        if kind == TEST:
            from rbxcompose.tools.mission_tests.reader import TrialReader  # only needed for tests

            reading = TrialReader(self.environment, self.unsaved)
            _, report = reading.read(path)
            robot = next((made.robot for made in reading.robots.values()), None)
            return Report([*reading.report, *report]), reading.sources, robot
        if kind == SYSTEM:
            from rbxcompose.compiler.systems.reader import compile_system  # only needed for systems

            system = compile_system(str(path), environment=self.environment, unsaved=self.unsaved, tries_profiles=True)
            return system.report, system.sources, None
        made = compile_robot(str(path), environment=self.environment, unsaved=self.unsaved, tries_profiles=True)
        return made.report, made.sources, made.robot

    def _lone_findings(self, path: Path) -> list[Finding]:
        report, sources = Report(), Texts(self.unsaved)
        if kind_of(self.text(path)) == MISSION:
            root = read_mission(path, robot="", report=report, sources=sources, environment=self.environment)
            if root is not None:
                read_program(root, report)
        elif base := self._base_of(path):
            return self._overlay_findings(path, base)
        return list(report) or list(Targets(files=[shown_name(path)]).unused({}, self.unsaved))

    def _overlay_findings(self, path: Path, base: Path) -> list[Finding]:
        """Return the findings in an overlay when it is applied to the robot beside it."""
        made = compile_robot(
            str(base), overlays=[str(path)], environment=self.environment, unsaved=self.unsaved, tries_profiles=True
        )
        return [finding for finding in made.report if finding.span and Path(finding.span.file).resolve() == path]


class Newest:
    """The project as last compiled, and the texts that have changed since.

    A thread works on a copy of the project, which replaces the project when it is done. A text that arrives meanwhile
    makes the copy outdated: it stops at the next robot, and the work starts again with all texts. So what is published
    always comes from the newest texts. All methods belong to the thread of the event loop.
    """

    def __init__(self, project: Project, publish: Callable[[FoundByFile], None]) -> None:
        self.project = project
        self._publish = publish
        self._waiting: dict[Path, str | None] = {}
        self._number = 0  # count of changes so far
        self._due = 0.0  # in loop time
        self._task: asyncio.Task[None] | None = None
        self._thread = ThreadPoolExecutor(1, "compile")

    def prepare(self) -> None:
        """Load what the first answer needs, in the thread; schemas of the other kinds take a sixth of a second each."""
        for kind in ("Robot", "Mission"):
            self._thread.submit(installed_schema, kind)

    def has(self, path: Path) -> bool:
        """Return whether the editor's text of a file replaces the saved one."""
        return self._waiting.get(path) is not None or (path in self.project.unsaved and path not in self._waiting)

    def text(self, path: Path) -> str:
        """Return the newest text of a file."""
        return waiting if (waiting := self._waiting.get(path)) is not None else self.project.text(path)

    @property
    def unsaved(self) -> dict[Path, str]:
        """Return the newest texts that are in the editor only."""
        there = {**self.project.unsaved, **self._waiting}
        return {path: text for path, text in there.items() if text is not None}

    def is_compiled(self, path: Path, text: str) -> bool:
        """Return whether the project was compiled with this text of a file."""
        return not self._waiting and self.project.text(path) == text

    def change(self, path: Path, text: str | None, pause: float = 0.0) -> None:
        """Take a new text (None: the saved one counts again) and compile it after a pause [s]."""
        self._waiting[path] = text
        self._number += 1
        loop = asyncio.get_running_loop()
        self._due = loop.time() + pause
        if self._task is None or self._task.done():
            self._task = loop.create_task(self._work())

    def compile_again(self, pause: float) -> None:
        """Compile all that is known after a pause [s], because files have changed on disk."""
        unsaved = self.unsaved
        for path in self.project.known | self._waiting.keys():
            self.change(path, unsaved.get(path), pause)

    def close(self) -> None:
        """Stop the thread; its current work becomes outdated."""
        self._number += 1
        self._waiting.clear()
        self._thread.shutdown(wait=False, cancel_futures=True)

    async def _work(self) -> None:
        loop = asyncio.get_running_loop()
        while self._waiting:
            if (pause := self._due - loop.time()) > 0:
                await asyncio.sleep(pause)
                continue
            number, texts = self._number, dict(self._waiting)
            project = self._copy(number)
            try:
                found = await loop.run_in_executor(self._thread, project.change_all, texts)
            except OutdatedError:
                continue
            if number == self._number:
                self.project = project
                self._waiting.clear()
                self._publish(found)

    def _copy(self, number: int) -> Project:
        """Return a copy of the project that becomes outdated with the first change after `number`."""
        return self.project.copy(lambda: number != self._number)
