"""The tools: each is a verb of the command line, or two, with arguments that are checked."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from typing import Any, TypeVar

from rbxcompose.base.config import Config
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Severity
from rbxcompose.base.requests import Refused
from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.lookup import answer_of, find_robot
from rbxcompose.domains.console.access import Role
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.requests import NoteInLog
from rbxcompose.tools.mcp.lanes import Lane
from rbxcompose.tools.mcp.project_paths import ProjectPaths, words_of_finding
from rbxcompose.tools.mcp.tool_arguments import (
    CheckArguments,
    DryRunArguments,
    ExplainArguments,
    MissionArguments,
    RobotArguments,
    RunArguments,
    StoryArguments,
    TrialArguments,
    UpArguments,
    WhyArguments,
)
from rbxcompose.tools.mcp.verb_process import run_verb

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
    texts = context.paths.texts(given.unsaved)
    words = ("check", "--format", "json", *_profiles(given.profiles), *paths)
    done = await run_verb(*words, folder=context.paths.root, unsaved=texts)
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
    texts = context.paths.texts(given.unsaved)
    words = ("why", given.value, robot, "--json", *_profiles(given.profiles))
    return dict((await run_verb(*words, folder=context.paths.root, unsaved=texts)).data(0))


async def _plan(context: ToolContext, given: RobotArguments) -> ToolAnswer:
    robot = await context.on_disk(context.paths.robot, given.robot)
    texts = context.paths.texts(given.unsaved)
    words = ("plan", robot, *_profiles(given.profiles))
    done = await run_verb(*words, folder=context.paths.root, unsaved=texts)
    if done.code:
        raise Refused(done.trouble)
    return {"plan": done.out.rstrip("\n")}


async def _test(context: ToolContext, given: TrialArguments) -> ToolAnswer:
    paths = await context.on_disk(context.paths.tests, given.paths)
    texts = context.paths.texts(given.unsaved)
    words = ("test", "--json", f"--filter={given.filter}", *paths)
    done = await run_verb(*words, folder=context.paths.root, unsaved=texts)
    tests = done.data(0, 1)["tests"]
    for test in tests:
        if test["passed"]:
            del test["trace"]  # only that of a failure says something
    passed = sum(test["passed"] for test in tests)
    return {"passed": passed, "failed": len(tests) - passed, "tests": tests}


async def _dry_run(context: ToolContext, given: DryRunArguments) -> ToolAnswer:
    robot = await context.on_disk(context.paths.robot, given.robot)
    texts = context.paths.texts(given.unsaved)
    words = ("mission", "try", given.mission, robot, "--json")
    tried = (await run_verb(*words, folder=context.paths.root, unsaved=texts)).data(0)
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
