"""The process behind the editor of the console: `python -m rbxcompose.tools.mission_editor.process ROBOT`.

It takes a request in JSON from each line of its input, and writes a line with the `answer`, or why it is `refused`. It
ends with its input. The compiler runs here, so that nothing holds up the gateway, where people drive.
"""

from __future__ import annotations

import json
import os
import re
import sys
import traceback
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Refused
from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.lookup import find_robot, known_state
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.compiler.model.robot import NOTHING
from rbxcompose.compiler.systems.model import System
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.compiler.systems.share import hosts_of
from rbxcompose.runtime.folder import ChosenLayers
from rbxcompose.tools.mission_editor.editor import Compile, MissionEditor
from rbxcompose.tools.robot_editor.editor import LIVE_REQUESTS, PREFIX, LiveRobot, RobotEditor, applied
from rbxcompose.tools.system_runs import planned

_NAMED = re.compile(r"\benv\.(\w+)")
_OF_PROGRAMS = re.compile(
    r"PATH|HOME|USER|LOGNAME|SHELL|LANG|LANGUAGE|TZ|TERM|TMPDIR|PYTHON\w+"
    r"|(LC|XDG|VIRTUAL|LD|NUMBA|OMP|RBX|RBXCOMPOSE|AMENT|ROS|RMW|ZENOH|MUJOCO)_\w+"
)
_NOT_UP = {"answer": None, "refused": "the robot is not up any more"}


class Variables:
    """The environment of `up`, of which the texts that visitors send get only what files on disk name."""

    def __init__(self) -> None:
        self.all = dict(os.environ)

    def restrict(self, sources: Mapping[str, str]) -> None:
        """Leave to this process, and to those that it starts, what programs need and what these files name."""
        named = {name for text in sources.values() for name in _NAMED.findall(text)}
        kept = {name for name in self.all if name in named or _OF_PROGRAMS.fullmatch(name)}
        for name in os.environ.keys() - kept:
            del os.environ[name]
        os.environ.update({name: self.all[name] for name in kept})


def compile_with(
    file: str, layers: ChosenLayers, variables: Variables | None = None
) -> tuple[Compile, Compile, tuple[str, ...]]:
    """Return what compiles a robot as it runs, what does so without real devices, and who shares its manifest.

    Its system is read once. What is on disk has all `variables`, what is not saved those that it may have.
    """
    whole: Mapping[str, str] = os.environ if variables is None else variables.all
    outside, others = NOTHING, tuple[str, ...]()
    if layers.system:
        system = compile_system(layers.system, environment=whole, real=layers.real, profiles=layers.system_profiles)
        outside = system.robots[layers.member].robot.outside if layers.member in system.robots else NOTHING
        others = _sharing(Path(file).resolve(), layers.member, system)

    def compiled(unsaved: Mapping[Path, str], *, real: bool = layers.real) -> Compilation:
        made = compile_robot(
            file,
            profiles=layers.profiles,
            overlays=layers.overlays,
            sets=layers.sets,
            real=real,
            environment=os.environ if unsaved else whole,
            unsaved=unsaved,
            outside=outside,
        )
        if variables is not None and not unsaved:
            variables.restrict(made.sources)
        return made

    return compiled, partial(compiled, real=False), others


def compiled_member(layers: ChosenLayers, environment: Mapping[str, str]) -> Compilation:
    """Compile a robot as a member of its system.

    Raises:
        Refused: if that does not run it on one host alone.
    """
    system = compile_system(layers.system, environment=environment, real=layers.real, profiles=layers.system_profiles)
    if system.report.has_errors:
        return Compilation(report=system.report)
    placed = system.robots.get(layers.member)
    hosts = hosts_of(system, placed) if placed else []
    if placed is None or len(hosts) != 1:
        where = "several hosts, which change together" if hosts else "no host of its system any more"
        raise Refused(f"this robot runs on {where}: {applied(layers)}")
    return Compilation(placed.robot, planned(system, placed, hosts[0]))


def _sharing(file: Path, member: str, system: System) -> tuple[str, ...]:
    """Return the other robots of a system that are made of the same file."""
    robots = {name: placed.robot.manifest.files.values() for name, placed in system.robots.items() if name != member}
    return tuple(name for name, files in robots.items() if file in files)


@dataclass(frozen=True, slots=True)
class RobotEditors:
    """The editors of what a robot is and of what it does, and the one that runs."""

    missions: MissionEditor
    robot: RobotEditor
    live: LiveRobot

    def answer(self, request: Mapping[str, Any]) -> Any:
        """Return the answer of the editor that a request is for.

        Raises:
            Refused: with the reason.
        """
        if request["do"] in LIVE_REQUESTS:
            return self.live.answer(request)
        return (self.robot if request["do"].startswith(PREFIX) else self.missions).answer(request)


def answer_line(editor: MissionEditor | RobotEditors, line: str) -> dict[str, Any]:
    """Return the answer to one request."""
    try:
        return {"answer": editor.answer(json.loads(line)), "refused": ""}
    except Refused as refusal:
        return {"answer": None, "refused": str(refusal)}
    except Exception as error:  # a mistake of ours must not end what others are typing
        traceback.print_exc()
        return {"answer": None, "refused": f"the editor has failed: {type(error).__name__}"}


def main(robot: str) -> int:
    """Answer requests until there are no more; `apply` may have brought other layers in between."""
    editor, state, answers = None, None, sys.stdout
    variables = Variables()
    variables.restrict({})
    sys.stdout = sys.stderr  # whatever a component prints in a dry run is no answer
    for line in sys.stdin:
        try:
            folder = find_robot(robot)
            newest = known_state(folder)
        except NotDoneError:
            newest = None
        if newest is not None and (state is None or (newest.file, newest.layers) != (state.file, state.layers)):
            compiled, simulated, others = compile_with(newest.file, newest.layers, variables)
            file = Path(newest.file)
            missions = MissionEditor(compiled, file, simulated)
            alone = partial(compiled, {})
            member = partial(compiled_member, newest.layers, variables.all)
            live = LiveRobot(folder, member if newest.layers.system else alone, newest.layers)
            state, editor = newest, RobotEditors(missions, RobotEditor(compiled, file, others), live)
        told = _NOT_UP if editor is None else answer_line(editor, line)
        answers.write(f"{json.dumps(told)}\n")
        answers.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
