"""States of machines, and the transitions between them."""

from collections.abc import Iterator

from rbxcompose.base.findings import DID_YOU_MEAN, OWN, Finding, Severity, replacement
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined, leading_to, reached, transitions
from rbxcompose.missions.language.keys import OUTCOMES
from rbxcompose.missions.program.answers import Form
from rbxcompose.missions.program.machines import MachineStates, Next
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
    elif "" in leads_to.spans:
        if ends.counting_as(FAILS):
            message = f"the state '{state.name}' can fail, so one word after 'next' is not enough"
            yield open_outcome.at(leads_to.spans[""], message, help=ONE_WORD)
    else:
        meant = {OUTCOMES.get(key.lower()) for key in leads_to.keys.keys() - ends.words.keys()}  # told there
        for word, counts_as in ends.words.items():
            if word not in meant and leads_to.key_for(word, counts_as) is None:
                message = f"the state '{state.name}' can end with '{word}', which leads nowhere"
                yield open_outcome.at(state.span, message, help=f"write '{word}: ...' under 'next'")


@mission_check("RBX4133", Severity.WARNING, closed=(OWN,))
def trapped_state(mission: Examined) -> Iterator[Finding]:
    """A state from which no path leads to an end."""
    for machine, states, leads in transitions(mission.program):
        used = reached(machine.start, leads)
        goals = {*machine.ends, *(state.name for state in states if state.step.leads_to is None)}
        if not used & machine.ends.keys():
            continue  # it is meant to run for ever
        free = leading_to(goals, leads)
        for state in states:
            if state.name in used and state.name not in free:
                yield trapped_state.at(
                    state.span,
                    f"no path leads from the state '{state.name}' to an end",
                    help="let one of its outcomes, or of the states after it, lead back or to an end",
                )


@mission_check("RBX4142", is_fixable=True)
def unknown_outcome(mission: Examined) -> Iterator[Finding]:
    """A transition for an outcome that cannot occur."""
    for node in mission.program.nodes:
        leads_to = node.step.leads_to
        below = mission.program.below(node.number)
        if (
            leads_to is None
            or "" in leads_to.to
            or any(mission_node.skill not in ("", *mission.robot.skills) for mission_node in below)
        ):
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


@mission_check("RBX4140", is_fixable=True)
def unknown_state(mission: Examined) -> Iterator[Finding]:
    """A transition leads to a state that does not exist."""
    for node in mission.program.nodes:
        if node.step.states:
            yield from _start(node.step.states)
            for child in node.children:
                yield from _targets(mission.program.nodes[child], node.step.states)


def _start(machine: MachineStates) -> Iterator[Finding]:
    if machine.start_span and machine.names and machine.start not in machine.names:
        message, what = f"there is no state '{machine.start}'", "states of this machine"
        yield unknown_state.misspelt(machine.start_span, message, machine.start, machine.names, what)


def _targets(state: MissionNode, machine: MachineStates) -> Iterator[Finding]:
    leads_to = state.step.leads_to
    known = (*machine.names, *machine.ends)
    if leads_to is None:
        return
    for outcome, to in leads_to.to.items():
        if to not in known:
            message = f"there is no state or end '{to}'"
            yield unknown_state.misspelt(leads_to.spans[outcome], message, to, known, "states and ends")


@mission_check("RBX4143", Severity.WARNING, closed=(OWN,))
def unreachable_state(mission: Examined) -> Iterator[Finding]:
    """A state that cannot be reached."""
    for machine, states, leads in transitions(mission.program):
        used = reached(machine.start, leads)
        for state in states if machine.start in leads else ():
            if state.name not in used and state.name not in machine.ends:  # its name is the mistake
                yield unreachable_state.at(state.span, f"no path leads to the state '{state.name}'")
