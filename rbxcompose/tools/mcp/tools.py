"""The tools: each is a verb of the command line, or two, with arguments that are checked."""

from __future__ import annotations

import asyncio
import json
import os
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import asynccontextmanager, suppress
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import Field

from rbxcompose.base.config import Config
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Severity
from rbxcompose.base.printable import plain
from rbxcompose.base.requests import Refused
from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.lookup import answer_of, find_robot
from rbxcompose.commands.targets import Targets, robot_path, robots_below, targets, tests_of
from rbxcompose.domains.console.access import Role
from rbxcompose.manifest.files import PREFIX, find
from rbxcompose.manifest.tree import ALL_BYTES
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.requests import NoteInLog
from rbxcompose.tools.mcp.verb_process import VerbOutput, run_verb

MOST_WAITING = 16  # in each lane
_WORD = r"^[A-Za-z0-9_$][^\s/\\]*$"  # never an option, and never a path
PlainWord = Annotated[str, Field(pattern=_WORD, max_length=200)]
PlainWordOrNone = Annotated[str, Field(pattern=rf"^$|{_WORD}", max_length=200)]
ProjectPath = Annotated[str, Field(min_length=1, max_length=1000)]


class Lane(Enum):
    """Calls of one lane wait for each other, and never for those of another; the value is how many go at once."""

    COMPILE = "2 that compile"
    LOOK = "4 that look at a robot"
    OPERATE = "4 that operate one"
    STOP = "4 that stop one"

    @property
    def at_once(self) -> int:
        """Return how many calls are carried out at once."""
        return int(self.value.split()[0])


class Lanes:
    """Lets calls go on when it is their turn."""

    def __init__(self, deadline: float) -> None:
        self._deadline = deadline
        self._turns = {lane: asyncio.Semaphore(lane.at_once) for lane in Lane}
        self._waiting = dict.fromkeys(Lane, 0)

    @asynccontextmanager
    async def turn(self, lane: Lane) -> AsyncIterator[None]:
        """Wait for a turn, and end it after the deadline.

        Raises:
            Refused: if too many wait already, or it takes too long.
        """
        if self._waiting[lane] >= MOST_WAITING:
            raise Refused("too many calls are waiting: try again")
        self._waiting[lane] += 1
        try:
            await self._turns[lane].acquire()
        finally:
            self._waiting[lane] -= 1
        try:
            async with asyncio.timeout(self._deadline):
                yield
        except TimeoutError as error:
            raise Refused(f"it took more than {self._deadline:g} s, and was ended") from error
        finally:
            self._turns[lane].release()


# Arguments, whose texts are what clients show


class WithTexts(Config):
    """Arguments of a tool that reads files."""

    unsaved: dict[str, str] = {}
    """Texts to use in place of those of files of the project, by path: a change is tried, and no file is written."""


class CheckArguments(WithTexts):
    """Arguments of `check`."""

    paths: Annotated[list[ProjectPath], Field(max_length=100)] = ["."]
    """Robots, missions, parts, tests or systems, or folders of them; without any, all robots of the project."""
    profiles: Annotated[list[PlainWord], Field(max_length=20)] = []
    """Profiles to apply."""


class ExplainArguments(Config):
    """Arguments of `explain`."""

    code: PlainWord
    """Such as RBX1001."""


class RobotArguments(WithTexts):
    """Arguments of a tool about a robot of the project."""

    robot: Annotated[str, Field(max_length=1000)] = ""
    """The robot's file or folder, or rbx:robots/NAME of the library; without it, the only one of the project."""
    profiles: Annotated[list[PlainWord], Field(max_length=20)] = []
    """Profiles to apply."""


class WhyArguments(RobotArguments):
    """Arguments of `why`."""

    value: PlainWord
    """The path of a value, such as battery.runtime, or of a port, such as go_to.cmd_vel."""


class TrialArguments(WithTexts):
    """Arguments of `test`."""

    paths: Annotated[list[ProjectPath], Field(max_length=100)] = ["missions"]
    """Tests, or folders of tests."""
    filter: Annotated[str, Field(max_length=200)] = ""
    """Only those with this text in their names."""


class DryRunArguments(WithTexts):
    """Arguments of `dry_run`."""

    mission: PlainWord
    """The name that the robot gives it."""
    robot: Annotated[str, Field(max_length=1000)] = ""
    """The robot's file or folder, or rbx:robots/NAME of the library; without it, the only one of the project."""


class UpArguments(Config):
    """Arguments of a tool about a robot that runs."""

    robot: PlainWordOrNone = ""
    """The name of a robot that is up; without it, the only one."""


class StoryArguments(UpArguments):
    """Arguments of `story`."""

    mission: PlainWordOrNone = ""
    """Only what this one did."""
    lines: Annotated[int, Field(ge=1, le=200)] = 100
    """How many of the newest lines."""


class MissionArguments(UpArguments):
    """Arguments of a tool about a mission that runs."""

    mission: PlainWordOrNone = ""
    """Which one; without it, the only one that runs."""


class RunArguments(UpArguments):
    """Arguments of `mission_run`."""

    mission: PlainWord
    """Which one."""
    inputs: dict[Annotated[str, Field(pattern=r"^[A-Za-z_][\w.]*$")], str] = {}
    """Its inputs as text, such as {"rounds": "2"}."""
    start: PlainWordOrNone = ""
    """Start in this state: 'outer.inner'."""


ToolAnswer = dict[str, Any]
P = TypeVar("P")
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class ToolContext:
    """What tools work with: the paths of the project, threads that look there, what logs call the client, its role."""

    paths: ProjectPaths
    threads: Executor
    client: str
    role: Role

    async def on_disk(self, find: Callable[[P], T], given: P) -> T:
        """Return what is found in the project, which may be large; nothing else waits for that."""
        return await asyncio.get_running_loop().run_in_executor(self.threads, find, given)

    async def verb(self, *words: str, given: WithTexts) -> VerbOutput:
        """Run a verb in the project, with the texts that are given in place of those of files."""
        return await run_verb(*words, folder=self.paths.root, unsaved=self.paths.texts(given.unsaved))


@dataclass(frozen=True, slots=True)
class VerbTool:
    """A tool: its name, what it is for, its arguments, and what carries it out."""

    name: str
    about: str
    arguments: type[Config]
    lane: Lane
    do: Callable[[ToolContext, Any], Awaitable[ToolAnswer]]

    @property
    def role(self) -> Role:
        """Return the least role that may use it."""
        return Role.VIEW if self.lane in (Lane.COMPILE, Lane.LOOK) else Role.OPERATE


async def _check(context: ToolContext, given: CheckArguments) -> ToolAnswer:
    paths = await context.on_disk(context.paths.checked, given.paths)
    done = await context.verb("check", "--format", "json", *_profiles(given.profiles), *paths, given=given)
    findings = done.data(0, 1)
    count = {severity: sum(finding["severity"] == severity for finding in findings) for severity in Severity}
    return {
        "is_fine": done.code == 0,
        "errors": count[Severity.ERROR],
        "warnings": count[Severity.WARNING],
        "findings": findings,
    }


async def _explain(context: ToolContext, given: ExplainArguments) -> ToolAnswer:
    done = await run_verb("explain", given.code, "--json", folder=context.paths.root)
    return dict(done.data(0))


async def _why(context: ToolContext, given: WhyArguments) -> ToolAnswer:
    robot = await context.on_disk(context.paths.robot, given.robot)
    done = await context.verb("why", given.value, robot, "--json", *_profiles(given.profiles), given=given)
    return dict(done.data(0))


async def _plan(context: ToolContext, given: RobotArguments) -> ToolAnswer:
    robot = await context.on_disk(context.paths.robot, given.robot)
    done = await context.verb("plan", robot, *_profiles(given.profiles), given=given)
    if done.code:
        raise Refused(done.trouble)
    return {"plan": done.out.rstrip("\n")}


async def _test(context: ToolContext, given: TrialArguments) -> ToolAnswer:
    paths = await context.on_disk(context.paths.tests, given.paths)
    done = await context.verb("test", "--json", f"--filter={given.filter}", *paths, given=given)
    tests = done.data(0, 1)["tests"]
    for test in tests:
        if test["passed"]:
            del test["trace"]  # only that of a failure says something
    passed = sum(test["passed"] for test in tests)
    return {"passed": passed, "failed": len(tests) - passed, "tests": tests}


async def _dry_run(context: ToolContext, given: DryRunArguments) -> ToolAnswer:
    robot = await context.on_disk(context.paths.robot, given.robot)
    tried = (await context.verb("mission", "try", given.mission, robot, "--json", given=given)).data(0)
    return {key: tried[key] for key in ("outcome", "why", "time", "left_out", "story")}


def _profiles(names: list[str]) -> list[str]:
    return [f"--profile={name}" for name in names]


# Robots that run


async def _state(context: ToolContext, given: UpArguments) -> ToolAnswer:
    robot = ("--robot", (await _found(given)).path.name, "--json")
    shown, watched = await asyncio.gather(run_verb("ps", *robot), run_verb("top", *robot))
    listed, seen = shown.data(0), watched.data(0)
    more = {component["name"]: component for component in seen["components"]}
    components = [{**more.get(component["name"], {}), **component} for component in listed["components"]]
    return {**seen, **{key: listed[key] for key in ("robot", "real", "stop")}, "components": components}


async def _story(context: ToolContext, given: StoryArguments) -> ToolAnswer:
    robot = (await _found(given)).path.name
    words = ("mission", "log", *([given.mission] if given.mission else []), "--robot", robot, "--json")
    done = await run_verb(*words)
    if done.code:
        raise Refused(done.trouble)
    lines = done.out.splitlines()
    shown = lines[-given.lines :]
    return {"robot": robot, "before": len(lines) - len(shown), "records": [json.loads(line) for line in shown]}


async def _found(given: UpArguments) -> RobotFolder:
    try:
        return await asyncio.to_thread(find_robot, given.robot or None)
    except NotDoneError as error:
        raise Refused(words_of_finding(error.finding)) from error


async def _operate(context: ToolContext, given: UpArguments, *words: str) -> ToolAnswer:
    """Say in a robot's log what it is to do, and have it do so."""
    folder = await _found(given)
    try:
        await asyncio.to_thread(answer_of, folder, _note(context, words))
    except NotDoneError as error:
        raise Refused(words_of_finding(error.finding)) from error
    return await _done(context, folder, words)


async def _done(context: ToolContext, folder: RobotFolder, words: Sequence[str]) -> ToolAnswer:
    return dict((await run_verb(*words, "--robot", folder.path.name, "--json")).data(0))


def _note(context: ToolContext, words: Sequence[str]) -> NoteInLog:
    return NoteInLog(f"{context.client} ({context.role.word}): asks {' '.join(words)}")


async def _run(context: ToolContext, given: RunArguments) -> ToolAnswer:
    sets = [f"--set={name}={text}" for name, text in given.inputs.items()]
    start = [f"--from={given.start}"] if given.start else []
    return await _operate(context, given, "mission", "run", given.mission, *sets, *start)


def _of_mission(action: str) -> Callable[[ToolContext, MissionArguments], Awaitable[ToolAnswer]]:
    async def do(context: ToolContext, given: MissionArguments) -> ToolAnswer:
        return await _operate(context, given, "mission", action, *([given.mission] if given.mission else []))

    return do


async def _stop(context: ToolContext, given: UpArguments) -> ToolAnswer:
    """Stop first: the note can wait, and a robot whose supervisor does not answer takes none."""
    folder, words = await _found(given), ("stop",)
    answer = await _done(context, folder, words)
    with suppress(NotDoneError):
        await asyncio.to_thread(answer_of, folder, _note(context, words))
    return answer


async def _release(context: ToolContext, given: UpArguments) -> ToolAnswer:
    return await _operate(context, given, "release")


TOOLS: Mapping[str, VerbTool] = {
    tool.name: tool
    for tool in (
        VerbTool(
            "check",
            "Find the mistakes of robots, missions, tests and systems of the project: each with its code, place, help "
            "and, where it is known, the fix.",
            CheckArguments,
            Lane.COMPILE,
            _check,
        ),
        VerbTool("explain", "Explain the code of a finding, with examples.", ExplainArguments, Lane.COMPILE, _explain),
        VerbTool(
            "why",
            "Show where a value of a robot comes from: its file and line, the layers below it, what it is for.",
            WhyArguments,
            Lane.COMPILE,
            _why,
        ),
        VerbTool("plan", "Show what would run: processes, components, topics.", RobotArguments, Lane.COMPILE, _plan),
        VerbTool("test", "Run the tests of missions in virtual time.", TrialArguments, Lane.COMPILE, _test),
        VerbTool(
            "dry_run",
            "Run a mission on the simulated robot in virtual time: its outcome, the time [s] and the story.",
            DryRunArguments,
            Lane.COMPILE,
            _dry_run,
        ),
        VerbTool(
            "state",
            "Show a robot that runs: components, missions, diagnostics, batteries, warnings, who has stopped it.",
            UpArguments,
            Lane.LOOK,
            _state,
        ),
        VerbTool("story", "Show what the missions of a robot that runs did.", StoryArguments, Lane.LOOK, _story),
        VerbTool("mission_run", "Start a mission: the robot may move.", RunArguments, Lane.OPERATE, _run),
        VerbTool("mission_pause", "Hold a mission.", MissionArguments, Lane.OPERATE, _of_mission("pause")),
        VerbTool(
            "mission_resume",
            "Resume a mission where it was held: the robot may move.",
            MissionArguments,
            Lane.OPERATE,
            _of_mission("resume"),
        ),
        VerbTool("mission_cancel", "End a mission for good.", MissionArguments, Lane.OPERATE, _of_mission("cancel")),
        VerbTool(
            "stop",
            "Stop everything that moves immediately, until it is released. It is no emergency stop.",
            UpArguments,
            Lane.STOP,
            _stop,
        ),
        VerbTool("release", "Allow motion again after a stop.", UpArguments, Lane.OPERATE, _release),
    )
}  # fmt: skip


def words_of_finding(finding: Finding) -> str:
    """Return why something is refused, and what helps."""
    return f"{finding.message}; {finding.help}" if finding.help else finding.message


class ProjectPaths:
    """The paths of the project in the current folder; each method raises `Refused` for what leads out of it."""

    def __init__(self) -> None:
        self.root = Path.cwd().resolve()

    def file(self, written: str) -> str:
        """Return the path of a file or folder of the project, relative to it."""
        try:
            real = (self.root / written).resolve()
            is_there = real.exists()
        except (OSError, ValueError, RuntimeError) as error:  # such as a name too long, a zero byte, a circle of links
            raise Refused(f"'{plain(written)}' is not a path") from error
        self._require_inside(real, written)
        if not is_there:
            raise Refused(f"'{plain(written)}' does not exist")
        return f"./{real.relative_to(self.root)}"  # never an option

    def checked(self, written: Iterable[str]) -> list[str]:
        """Return paths that `check` takes: all that they mean must be in the project, or in the library."""
        paths = [path if path.startswith(PREFIX) else self.file(path) for path in written]
        for path in _named(targets(paths)):
            self._require_inside(Path(path).resolve(), path)
        return paths

    def tests(self, written: Iterable[str]) -> list[str]:
        """Return paths of tests, or of folders of tests."""
        paths = [self.file(path) for path in written]
        for path in tests_of(map(Path, paths)):
            self._require_inside(path.resolve(), str(path))
        return paths

    def robot(self, written: str) -> str:
        """Return the path of a robot; without one, that of the only robot here."""
        try:
            path = written or robot_path(None, may_run=False)
        except NotDoneError as error:
            raise Refused(words_of_finding(error.finding)) from error
        path = path if path.startswith(PREFIX) else self.file(path)
        found = find(path)
        if isinstance(found, Finding):
            raise Refused(words_of_finding(found))
        if not path.startswith(PREFIX):
            self._require_inside(found, written)
        return path

    def robots(self) -> list[str]:
        """Return the paths of the robots of the project."""
        return [path for path in robots_below(Path()) if Path(path).resolve().is_relative_to(self.root)]

    def texts(self, unsaved: Mapping[str, str]) -> dict[str, str]:
        """Return texts in place of those of files, by their paths."""
        if sum(map(len, unsaved.values())) > ALL_BYTES:
            raise Refused(f"these texts have more than {ALL_BYTES:,} characters")
        texts = {self.file(path): text for path, text in unsaved.items()}
        for path in texts:
            if not Path(path).is_file():
                raise Refused(f"'{plain(path)}' is not a file")
        return texts

    def _require_inside(self, real: Path, written: str) -> None:
        if not real.is_relative_to(self.root):
            named = Path(os.path.normpath(self.root / written))
            how = "leads through a link out of" if named.is_relative_to(self.root) else "is outside"
            raise Refused(f"'{plain(written)}' {how} the project '{plain(str(self.root))}'")


def _named(found: Targets) -> Iterator[str]:
    """Yield the files of a project that targets mean."""
    for paths in (found.robots, *found.overlays, found.users, found.files, found.tests, found.systems):
        yield from (path for path in paths if not path.startswith(PREFIX))
