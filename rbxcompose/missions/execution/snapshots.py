"""Snapshots of missions on disk: how far a mission was, for when its process crashed or the machine lost power.

One file for each mission of a robot, below `$XDG_STATE_HOME/rbxcompose/snapshots`, replaced at most once in `PERIOD`.
It is not flushed to disk, which would take longer than all the rest: a power failure may lose the last seconds.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from rbxcompose.base.files import TEMPORARY, state_folder
from rbxcompose.manifest.tree import MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions.engine.debugger import named
from rbxcompose.missions.engine.engine import Engine
from rbxcompose.missions.engine.snapshot import from_plain, save, to_plain
from rbxcompose.missions.execution.breakpoints import written
from rbxcompose.missions.execution.mission_run import MissionRun
from rbxcompose.missions.execution.requests import ListedSnapshot
from rbxcompose.missions.program.outcomes import RUNNING
from rbxcompose.missions.program.program import Program, RobotNames

PERIOD = 1.0  # [s] between two snapshots of a mission
ROUNDING = 1e-6  # [s]
VERSION = 1
_ASIDE = ".before"  # the snapshot of an earlier run that did not end
_ENDED = (("", _ASIDE), (_ASIDE,))  # what may be left of such runs, without and with one that runs


class SnapshotStore:
    """The snapshots of a robot's missions; a robot on a stepped clock keeps none."""

    def __init__(self, robot: str, *, is_kept: bool) -> None:
        self._folder = state_folder() / "snapshots" / robot if is_kept else None
        self._due: dict[str, float] = {}
        self._known: dict[str, Any] = {}  # what the latest snapshot of each mission has
        self._made_of: dict[str, tuple[Engine, Mapping[str, str]]] = {}
        self.trouble = ""  # why the latest one could not be written
        self.unusable: dict[str, str] = {}  # what is wrong with files, by their paths

    def keep(self, run: MissionRun, now: float) -> float | None:
        """Write a snapshot if something has changed; return when to look again [s] if that is too early."""
        engine = run.engine
        if self._folder is None or engine.status != RUNNING:
            return None
        state = (engine, list(engine.statuses), dict(engine.data), run.is_paused)  # another one has another identity
        if self._known.get(run.name) == state:
            return None
        if now < self._due.get(run.name, now) - ROUNDING:
            return self._due[run.name]
        self._due[run.name], self._known[run.name] = now + PERIOD, state
        if self._made_of.get(run.name, (None,))[0] is not engine:
            self._made_of[run.name] = engine, identity_of(engine.program, engine.robot)
        state_now = {"is_paused": run.is_paused, "state": save(engine)}
        content = {"version": VERSION, "identity": self._made_of[run.name][1], **state_now}
        self._write(self._path(run.name), content)
        return None

    def read(self, mission: str) -> Mapping[str, Any] | None:
        """Return the snapshot of the latest run of a mission, if that did not end."""
        found = next(self._found(mission, ("",)), None)
        return found[1] if found else None

    def left_over(self, mission: str, *, runs: bool) -> tuple[float, Mapping[str, Any]] | None:
        """Return the time and the content of the snapshot of a run that did not end; that of one that runs is none."""
        return next(self._found(mission, _ENDED[runs]), None)

    def forget(self, mission: str, *, runs: bool) -> None:
        """Drop what `left_over` returns, and what is older.

        Raises:
            OSError: if it cannot be removed.
        """
        for aside in _ENDED[runs]:
            self._path(mission, aside).unlink(missing_ok=True)

    def _found(self, mission: str, asides: Iterable[str]) -> Iterator[tuple[float, Mapping[str, Any]]]:
        for path in (self._path(mission, aside) for aside in asides if self._folder):
            try:
                content, at = json.loads(path.read_bytes()), path.stat().st_mtime
                if not isinstance(content, dict) or content.get("version") != VERSION:
                    raise ValueError("it is of another version")
            except FileNotFoundError:
                continue
            except (OSError, ValueError) as error:
                self.unusable[str(path)] = f"the snapshot '{path}' cannot be used: {error}"
            else:
                yield at, content

    def drop(self, mission: str) -> None:
        """Forget the snapshot of a mission that has ended."""
        self._due.pop(mission, None)
        self._known.pop(mission, None)
        if self._folder:
            with suppress(OSError):
                self._path(mission).unlink()

    def take_up(self, mission: str) -> None:
        """Let the snapshot that a mission goes on from be that of its run, so that nobody goes on from it twice."""
        if self._folder:
            latest, aside = self._path(mission), self._path(mission, _ASIDE)
            with suppress(OSError):
                if latest.exists():
                    aside.unlink()
                else:
                    os.replace(aside, latest)

    def set_aside(self, mission: str) -> None:
        """Keep the snapshot of a run that did not end for whoever asks for it, since a new run begins."""
        if self._folder:
            with suppress(OSError):
                os.replace(self._path(mission), self._path(mission, _ASIDE))

    @property
    def triggers_file(self) -> Path | None:
        """Return where what is known of triggers is kept; no mission has this name."""
        return None if self._folder is None else self._folder / "-triggers.json"

    def _path(self, mission: str, aside: str = "") -> Path:
        return (self._folder or Path()) / f"{mission}{aside}.json"

    def _write(self, path: Path, content: Mapping[str, Any]) -> None:
        try:
            replace_unflushed(path, json.dumps(content))
            self.trouble = ""
        except OSError as error:
            self.trouble = f"snapshots cannot be written: {error.strerror}"


def described(
    mission: str, at: float, state: Mapping[str, Any], program: Program, *, changed: str = "", waits: bool = False
) -> ListedSnapshot:
    """Return what people are told of the state of a run that did not end; `program` is the linked mission."""
    given = {} if changed else from_plain(state["runs"][0]["inputs"])
    texts = {name: written(value, program.inputs[name].type) for name, value in given.items() if name in program.inputs}
    running = zip(program.nodes, () if changed else state["statuses"], strict=False)
    leaves = dict.fromkeys(named(node) for node, status in running if status == RUNNING and not node.children)
    inputs = {name: text for name, text in texts.items() if text is not None}
    return ListedSnapshot(mission, at, " and ".join(leaves), inputs, changed, waits)


def replace_unflushed(path: Path, text: str) -> None:
    """Replace a file as a whole, without waiting for the disk: it is for a process that fails.

    Raises:
        OSError: if it cannot be written.
    """
    temporary = path.with_suffix(TEMPORARY)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary.write_text(text, encoding="utf-8")
    os.replace(temporary, path)


def identity_of(program: Program, robot: RobotNames) -> dict[str, str]:
    """Return what a snapshot depends on, each with its digest: the missions, and what the robot offers them."""
    used = [program, *(node.inner for node in program.nodes if node.inner)]
    skills = {node.skill: robot.skills[node.skill] for node in program.nodes if node.skill in robot.skills}
    shapes = {
        name: [sorted(skill.arguments), skill.claims, skill.restartable, skill.pausable, sorted(skill.outcomes)]
        for name, skill in sorted(skills.items())
    }
    values = {name: robot.values[name].detail for name in sorted(program.reads & robot.values.keys())}
    parts: dict[str, Any] = {
        **{f"mission '{one.name}'": _plain(one.root) for one in used},
        "places": {name: to_plain(place) for name, place in sorted(robot.places.items())},
        "skills": shapes,
        "values": values,
    }
    return {name: hashlib.sha256(json.dumps(part).encode()).hexdigest()[:16] for name, part in parts.items()}


def differences(saved: Mapping[str, Any], now: Mapping[str, str]) -> str:
    """Return in words what has changed since a snapshot; empty if nothing has."""
    return " and ".join(sorted(_changed(saved, now)))


def _changed(saved: Mapping[str, Any], now: Mapping[str, str]) -> Iterator[str]:
    for name in {*saved, *now}:
        if saved.get(name) != now.get(name):
            yield f"the {name}" if name.startswith("mission") else f"the robot's {name}"


def _plain(node: TreeNode) -> Any:
    match node:
        case MappingNode():
            return {key: _plain(entry.value) for key, entry in node.entries.items()}
        case SequenceNode():
            return [_plain(item) for item in node.items]
        case ScalarNode():
            return [node.text, str(node.filled)]
