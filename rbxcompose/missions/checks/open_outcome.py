"""Outcomes of states without a transition."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.language.foreign_steps import OUTCOMES
from rbxcompose.missions.program.look import Form
from rbxcompose.missions.program.machines import Next
from rbxcompose.missions.program.outcomes import FAILS, Outcomes
from rbxcompose.missions.program.program import MissionNode

ONE_WORD = "write 'next' as a map with 'success' and 'failure'"


@mission_check("RBX4141")
def open_outcome(mission: Examined) -> Iterator[Finding]:
    """An outcome of a state leads nowhere."""
    for node in mission.program.nodes:
        if node.step.look.form is Form.STATE:
            yield from _open(node, node.step.leads_to, mission.ending.of(node.number))


def _open(state: MissionNode, leads_to: Next | None, ends: Outcomes) -> Iterator[Finding]:
    if leads_to is None:
        if ends.words:
            message = f"the state '{state.name}' needs 'next': where it leads to"
            listed = " or ".join(f"'{word}'" for word in ends.words)
            yield open_outcome.at(state.span, message, help=f"it can end with {listed}")
    elif "" in leads_to.to:
        if ends.counting_as(FAILS):
            message = f"the state '{state.name}' can fail, so one word after 'next' is not enough"
            yield open_outcome.at(leads_to.spans[""], message, help=ONE_WORD)
    else:
        meant = {OUTCOMES.get(key.lower()) for key in leads_to.keys.keys() - ends.words.keys()}  # told there
        for word, counts_as in ends.words.items():
            if word not in meant and word not in leads_to.to and counts_as not in leads_to.to:
                message = f"the state '{state.name}' can end with '{word}', which leads nowhere"
                yield open_outcome.at(state.span, message, help=f"write '{word}: ...' under 'next'")
