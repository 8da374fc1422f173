"""`up --watch`: recompile a running robot when one of its files changes, and apply the difference."""

from __future__ import annotations

import time
from collections.abc import Callable, Set
from pathlib import Path

from rbxcompose.cli.output.console import refuse, tell, tell_report
from rbxcompose.cli.robots.file_watch import FileWatch
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.cli.robots.proposal import Proposal
from rbxcompose.compiler import Compilation
from rbxcompose.composition.overlay import SET
from rbxcompose.manifest.library import PREFIX
from rbxcompose.runtime.options import ChosenLayers

_LOOK = 0.25  # [s] between checks of the files; a change is taken at the second check that finds it unchanged
_AGAIN = 0.5  # [s] between retries of what the robot cannot do now


class LiveReload:
    """Follows the files of a running robot. Changes that are impossible while it moves wait; that is reported once."""

    def __init__(self, compiled: Callable[[], Compilation], first: Compilation, layers: ChosenLayers) -> None:
        """`compiled` compiles the files again, with the same `layers` as at `first`."""
        self._compiled, self._newest, self._layers = compiled, first, layers
        self._files = FileWatch(files_of(first))
        self._is_pending = False  # the newest is to be applied as soon as possible
        self._told = ""  # the reported reason for waiting
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
        self._files.follow(files_of(found))
        tell_report(found.report, found.sources)
        self._told = ""
        self._is_pending = found.plan is not None
        self._next_try = 0.0
        if found.plan is None:
            tell("the files have changed and have errors: the robot stays as it is")

    def _take(self) -> None:
        """Show the difference and apply it, or wait."""
        if self._newest.plan is None or self._newest.robot is None:
            return
        try:
            proposal = Proposal.of(self._newest.plan, self._newest.robot, self._layers)
            is_impossible = bool(proposal.found.impossible)
            self._is_pending = bool(proposal.why_not) and not is_impossible
            if proposal.is_empty:
                tell("the files have changed, the robot stays the same")
                return
            if not self._told:
                tell(proposal.text())
            if not proposal.why_not:
                tell(f"the robot is changed: {proposal.apply()}")
            elif not self._told:
                tell(f"{'not done' if is_impossible else 'waits'}: {proposal.why_not}")
            self._told = self._told or proposal.why_not
        except NotDoneError as error:
            self._is_pending = False
            refuse(error.finding)


def files_of(found: Compilation) -> Set[Path]:
    """Return the files that a robot was read from; after mistakes also their folders, where a file may be missing."""
    names = (name for name in found.sources if name != SET and not name.startswith(PREFIX))
    files = {Path(name).absolute() for name in names}
    return files | {path.parent for path in files} if found.plan is None else files
