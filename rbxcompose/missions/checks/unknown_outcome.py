"""Transitions that are never taken."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import DID_YOU_MEAN, Finding, replacement
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.language.foreign_steps import OUTCOMES


@mission_check("RBX4142", is_fixable=True)
def unknown_outcome(mission: Examined) -> Iterator[Finding]:
    """A transition for an outcome that cannot occur."""
    for node in mission.program.nodes:
        leads_to = node.step.leads_to
        below = mission.program.below(node.number)
        if leads_to is None or "" in leads_to.to or any(one.skill not in ("", *mission.robot.skills) for one in below):
            continue  # how a skill may end that the robot does not have is not known
        words, handled = mission.ending.of(node.number).words, leads_to.to
        counted = {counts_as for word, counts_as in words.items() if word not in handled}
        for outcome in leads_to.keys:
            if outcome not in words and outcome not in counted:
                message = f"the state '{node.name}' never ends with '{outcome}'"
                if (ours := OUTCOMES.get(outcome.lower())) in words and ours is not None and ours not in handled:
                    fix = replacement(leads_to.keys[outcome], outcome, ours, is_safe=False)
                    yield unknown_outcome.at(leads_to.keys[outcome], message, help=f"{DID_YOU_MEAN} '{ours}'?", fix=fix)
                    continue
                yield unknown_outcome.misspelt(
                    leads_to.keys[outcome], message, outcome, words, "its outcomes", taken=handled
                )
