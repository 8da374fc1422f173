"""Steps that are never reached."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from rbxcompose.findings import Finding, Related, Severity, Span
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.endings import Ending
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.analysis.facts import never_skipped
from rbxcompose.missions.program.outcomes import SUCCEEDS
from rbxcompose.missions.program.program import MissionNode, Program
from rbxcompose.rules import OWN


@mission_check("RBX4125", Severity.WARNING, closed=(OWN,))
def after_forever(mission: Examined) -> Iterator[Finding]:
    """A step is never reached."""
    for node in mission.program.nodes:
        if found := _barrier(mission.program, node, mission.ending):
            barrier, following, why, cure = found
            if mistaken := _endless_branch(barrier, mission.ending):
                yield after_forever.at(
                    mistaken,
                    f"this branch {why}, so the step after it is never reached",
                    help="name the branch that ends",
                    related=[Related(following.span, "the step")],
                )
                continue
            yield after_forever.at(
                following.span,
                f"this step is never reached: the one before it {why}",
                help=cure,
                related=[Related(barrier.span, "this one")],
            )


def _endless_branch(barrier: MissionNode, ending: Ending) -> Span | None:
    """Return where a parallel is told to end with a branch that never does, beside others that do."""
    branches = barrier.step.branches
    if branches is None or not branches.ends_with:
        return None
    ends = ending.of_branches(barrier)
    others = [one.counting_as(SUCCEEDS) for name, one in ends.items() if name != branches.ends_with]
    return branches.ends_at if any(others) else None


def _barrier(program: Program, node: MissionNode, ending: Ending) -> tuple[MissionNode, MissionNode, str, str] | None:
    """Return the first step after which none can run, the next step, and why."""
    steps = [program.nodes[child] for child in node.children]
    for step, following in pairwise(steps) if node.step.goes_on_after else ():
        if ending.of(step.number).counting_as(node.step.goes_on_after):
            continue
        if node.step.goes_on_after == SUCCEEDS:
            return step, following, "never ends in success", "put this one before it, or let that one end in success"
        if never_skipped(program, step):
            return step, following, "never fails", "put this one before it: a fallback goes on after a failure"
    return None
