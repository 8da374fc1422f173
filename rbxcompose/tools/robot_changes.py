"""Change a running robot to what its files say now: the proposal, its outcome, and `up --watch`."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Iterable, Set
from pathlib import Path
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import to_data
from rbxcompose.commands.console import NotDoneError, emit, misused, refuse, write_report
from rbxcompose.commands.lookup import REFUSED, answer_of, find_robot, known_state, version_problem
from rbxcompose.compiler.compile import Compilation
from rbxcompose.compiler.composition.overlay import SET
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.plan.dump import dump
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.manifest.files import PREFIX
from rbxcompose.runtime.folder import ChosenLayers, RobotFolder
from rbxcompose.runtime.plan_requests import ApplyPlan, ComparePlan, PlanComparison
from rbxcompose.runtime.supervision.plan_change import LONGEST, Fate
from rbxcompose.tools.inspection.plan_text import changes_text, with_places

_COMPARE = 10.0  # [s] for the supervisor to read a plan
LONGEST_CHANGE = LONGEST + _COMPARE  # [s]
_LOOK = 0.25  # [s] between checks of the files; a change is taken at the second check that finds it unchanged
_AGAIN = 0.5  # [s] between retries of what the robot cannot do now


@dataclass(frozen=True, slots=True)
class Proposal:
    """What another plan would change in a running robot, and why it cannot do so now, if it cannot."""

    folder: RobotFolder
    plan: str
    found: PlanComparison
    layers: ChosenLayers
    data: dict[str, Any]
    """What was found, with places in the robot's files, for programs."""

    @classmethod
    def of(cls, plan: Plan, robot: Robot, layers: ChosenLayers) -> Proposal:
        """Ask the running robot of this name what the plan, compiled with these layers, would change.

        Raises:
            NotDoneError: if none is up, it does not answer, it runs another version of rbxcompose, or it belongs to a
                system, and the layers to none.
        """
        folder, text = find_robot(plan.robot), dump(plan, reveals_secrets=True)  # the socket is this user's alone
        if (state := known_state(folder)) and (problem := version_problem(state.robot, state.package_version)):
            raise NotDoneError(REFUSED.at(None, problem))
        if state and state.layers.system and not layers.system:
            message = f"'{state.robot}' belongs to a system, which decides what the robot is given"
            help_text = f"rbxcompose apply {state.layers.system} --robot {state.layers.member}"
            raise NotDoneError(REFUSED.at(None, message, help=help_text))
        found = answer_of(folder, ComparePlan(text), timeout=_COMPARE)
        return cls(folder, text, found, layers, with_places(to_data(found), robot))

    @property
    def is_empty(self) -> bool:
        """Return whether nothing would change."""
        found = self.found
        return not (found.impossible or found.shares_change) and all(
            component.fate is Fate.KEPT for component in found.components
        )

    @property
    def why_not(self) -> str:
        """Return why the change is impossible now, or nothing if it is possible."""
        return self.found.why_not

    def text(self) -> str:
        """Return the difference for people."""
        return changes_text(self.data)

    def apply(self) -> str:
        """Apply the changes and return the robot's report.

        Raises:
            NotDoneError: if the robot refuses, applies them only in part, or does not answer.
        """
        return answer_of(self.folder, ApplyPlan(self.plan, self.found.generation, self.layers), timeout=LONGEST_CHANGE)


def carry_out(proposal: Proposal, arguments: argparse.Namespace) -> int:
    """Apply a change unless the robot refuses, or a person; return the exit code."""
    name = proposal.folder.path.name
    if proposal.why_not:
        return refuse(REFUSED.at(None, f"'{name}' refuses: {proposal.why_not}"))
    if arguments.dry_run or proposal.is_empty:
        return 0
    if (problem := unsure(name, arguments)) is not None:
        return problem
    answer = proposal.apply()
    if not arguments.json:
        emit(f"{name} is changed: {answer}")
    return 0


def unsure(name: str, arguments: argparse.Namespace) -> int | None:
    """Ask a person, unless the command says it; return the exit code if nothing is to be done."""
    if arguments.yes:
        return None
    if arguments.json or not sys.stdin.isatty():
        return misused("apply", "there is no terminal to ask: give --yes, or --dry-run to only look")
    sys.stdout.write(f"change '{name}'? [y/N] ")
    sys.stdout.flush()
    if sys.stdin.readline().strip().lower() in ("y", "yes"):
        return None
    emit("nothing was changed")
    return 0


_Stamp = tuple[int, int, int] | None  # time of the last change [ns], size [B], inode; None: no such file


class FileWatch:
    """Reports each change of files once. An editor may write a file in place, or replace it by another."""

    def __init__(self, paths: Iterable[Path]) -> None:
        self._known = {path: _stamp(path) for path in paths}  # as they were at the last report
        self._seen = self._known  # as they were at the last call of `look`

    def follow(self, paths: Iterable[Path]) -> None:
        """Watch these files from now on; earlier changes to files that were watched before still count."""
        self._known = {path: self._known[path] if path in self._known else _stamp(path) for path in paths}
        self._seen = self._known

    def look(self) -> bool:
        """Return whether files have changed, but not since the last call."""
        now = {path: _stamp(path) for path in self._known}
        is_settled, self._seen = now == self._seen, now
        if now == self._known or not is_settled:
            return False
        self._known = now
        return True


def _stamp(path: Path) -> _Stamp:
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_ctime_ns, found.st_size, found.st_ino


class LiveReload:
    """Follows the files of a running robot. Changes that are impossible while it moves wait; that is reported once."""

    def __init__(self, compiled: Callable[[], Compilation], first: Compilation, layers: ChosenLayers) -> None:
        """`compiled` compiles the files again, with the same `layers` as at `first`."""
        self._compiled, self._newest, self._layers = compiled, first, layers
        self._paths = files_of(first)
        self._files = FileWatch(self._paths)
        self._is_pending = False  # the newest is to be applied as soon as possible
        self._reported = ""  # the reported reason for waiting
        self._next_look = self._next_try = 0.0  # [s, monotonic]

    def look(self) -> None:
        """Do what is due; call it often."""
        now = time.monotonic()
        if now >= self._next_look:
            self._next_look = now + _LOOK
            if self._files.look():
                self._compile()
        if self._is_pending and now >= self._next_try:
            self._next_try = now + _AGAIN
            self._take()

    def _compile(self) -> None:
        self._newest = found = self._compiled()
        self._paths = files_of(found, self._paths)
        self._files.follow(self._paths)
        write_report(found.report, found.sources)
        self._reported = ""
        self._is_pending = found.plan is not None
        self._next_try = 0.0
        if found.plan is None:
            emit("the files have changed and have errors: the robot stays as it is")

    def _take(self) -> None:
        """Show the difference and apply it, or wait."""
        if self._newest.plan is None or self._newest.robot is None:
            return
        try:
            proposal = Proposal.of(self._newest.plan, self._newest.robot, self._layers)
            is_impossible = bool(proposal.found.impossible)
            self._is_pending = bool(proposal.why_not) and not is_impossible
            if proposal.is_empty:
                emit("the files have changed, the robot stays the same")
                return
            if not self._reported:
                emit(proposal.text())
            if not proposal.why_not:
                emit(f"the robot is changed: {proposal.apply()}")
            elif not self._reported:
                emit(f"{'not done' if is_impossible else 'waits'}: {proposal.why_not}")
            self._reported = self._reported or proposal.why_not
        except NotDoneError as error:
            self._is_pending = False
            refuse(error.finding)


def files_of(found: Compilation, before: Set[Path] = frozenset()) -> Set[Path]:
    """Return the files that a robot was read from.

    After mistakes also their folders, and the files `before`: those that are missing now may come back.
    """
    names = (name for name in found.sources if name != SET and not name.startswith(PREFIX))
    files = {Path(name).absolute() for name in names}
    return files | {path.parent for path in files} | before if found.plan is None else files
