"""Whether the programs and containers of a robot can run on this machine, looked at before anything starts."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence

from rbxcompose.base.findings import Finding, kind
from rbxcompose.base.printable import plain
from rbxcompose.compiler.model.flow import setting_span
from rbxcompose.compiler.model.robot import Robot, RobotComponent
from rbxcompose.domains.programs.keeper import found, obstacle
from rbxcompose.sdk.capabilities import RunsContainer, RunsProgram, RunsRosNode

CANNOT_RUN = kind("RBX9427")
NO_ENGINE = kind("RBX9428")
NO_IMAGE = kind("RBX9429")
ENGINES = ("docker", "podman")
_PATIENCE = 10.0  # [s] for an engine to answer

AskEngine = Callable[[Sequence[str]], str]
"""Runs a command and returns why it has failed, "" if it has not."""


class NoEngineError(Exception):
    """Raised if no engine runs containers here; the text says why."""


def program_findings(robot: Robot, environment: Mapping[str, str], ask: AskEngine) -> Iterator[Finding]:
    """Yield why the programs, containers and nodes of a robot cannot run here, with the environment of `up`."""
    path = environment.get("PATH", os.defpath)
    for component, runs in robot.declared(RunsProgram):
        yield from _of_program(robot, component, runs, runs.environment.value.get("PATH", path))
    for component, runs_image in robot.declared(RunsContainer):
        yield from _of_container(robot, component, runs_image, path, ask)
    for component, node in robot.declared(RunsRosNode):
        for place, needed in ((node.python, os.X_OK), (node.setup, os.R_OK)):
            if place.value and not os.access(place.value, needed):
                words = f"'{component.name}' cannot be started: ROS 2 is not at {plain(place.value)}"
                yield CANNOT_RUN.at(setting_span(robot, (component, place.field)), words)


def _of_program(robot: Robot, component: RobotComponent, runs: RunsProgram, path: str) -> Iterator[Finding]:
    word, folder = runs.command.value[0], runs.folder.value or "."
    if why := obstacle(word, folder, path):
        file = found(word, folder, path)
        is_plain = os.path.isfile(file) and not os.access(file, os.X_OK)
        field = runs.command.field if os.path.isdir(folder) else runs.folder.field
        yield CANNOT_RUN.at(
            setting_span(robot, (component, field)),
            f"'{component.name}' cannot be started: {plain(why)}",
            help=f"chmod +x {plain(file)}" if is_plain else "",
        )


def _of_container(
    robot: Robot, component: RobotComponent, runs: RunsContainer, path: str, ask: AskEngine
) -> Iterator[Finding]:
    image = runs.image.value
    try:
        engine = engine_of(runs.engine.value, path, ask)
    except NoEngineError as error:
        span = setting_span(robot, (component, runs.engine.field))
        yield NO_ENGINE.at(span, f"'{component.name}' needs an engine for containers: {plain(str(error))}")
        return
    if ask([engine, "image", "inspect", image]):
        span, name = setting_span(robot, (component, runs.image.field)), os.path.basename(engine)
        yield NO_IMAGE.at(span, f"the image '{image}' is not on this machine", help=f"{name} pull {image}")


def engine_of(wanted: str, path: str, ask: AskEngine) -> str:
    """Return the file of the wanted engine, with `auto` that of the first one that works.

    Raises:
        NoEngineError: if none does.
    """
    engines = ENGINES if wanted == "auto" else (wanted,)
    files = {engine: file for engine in engines if (file := found(engine, ".", path))}
    if not files:
        raise NoEngineError(f"{' or '.join(engines)} is not installed")
    problems = {}
    for engine, file in files.items():
        if not (problem := ask([file, "version"])):
            return file
        problems[engine] = problem
    raise NoEngineError("; ".join(f"{engine} does not work: {problem}" for engine, problem in problems.items()))


def ask_for_real(command: Sequence[str]) -> str:
    """Run a command, and return why it has failed: the last line that it wrote."""
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace", timeout=_PATIENCE
        )
    except subprocess.TimeoutExpired:
        return f"no answer within {_PATIENCE:g} s"
    except OSError as error:
        return error.strerror or str(error)
    lines = (done.stderr.strip() or done.stdout.strip() or f"it ended with status {done.returncode}").splitlines()
    return lines[-1] if done.returncode else ""
