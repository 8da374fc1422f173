"""What can be wrong with a machine: transitions that are missing, that cannot happen, or that lead nowhere."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from rbxcompose.findings import Finding
from rbxcompose.missions import codes as node_codes
from rbxcompose.missions import machine_codes as codes
from rbxcompose.missions.machines import MachineOptions, Next, StateOptions
from rbxcompose.missions.outcomes import FAILS, Ending, Outcomes
from rbxcompose.missions.program import Node

if TYPE_CHECKING:
    from rbxcompose.missions.views import View

ONE_WORD = "write 'next' as a map with 'success' and 'failure'"


def check_machine(view: View) -> Iterator[Finding]:
    """Yield what is wrong with the transitions of a machine."""
    options, nodes = view.node.options, view.program.nodes
    if not isinstance(options, MachineOptions):
        return
    ending = Ending(view.program, view.robot)
    leads: dict[str, set[str]] = {}
    for child in view.node.children:
        state = nodes[child]
        leads_to = state.options.next if isinstance(state.options, StateOptions) else None
        yield from _transitions(state, leads_to, ending.of(child))
        yield from _targets(state, leads_to, options)
        leads[state.name] = set(leads_to.to.values()) if leads_to else set()
    if not view.waits and not ending.of(view.node.number).words:
        help_text = "put a 'wait' into a state, or lead to an end"
        yield node_codes.NEVER_WAITS.at(view.node.span, "this machine never ends and never waits", help=help_text)
    reached, open_ones = {options.start}, [options.start]
    while open_ones:
        new = leads.get(open_ones.pop(), set()) - reached
        reached |= new
        open_ones.extend(new)
    for child in view.node.children if options.start in leads else ():
        if nodes[child].name not in reached:
            yield codes.UNREACHABLE_STATE.at(nodes[child].span, f"no way leads to the state '{nodes[child].name}'")


def _transitions(state: Node, leads_to: Next | None, ends: Outcomes) -> Iterator[Finding]:
    words = ends.words
    if leads_to is None:
        if words:
            message = f"the state '{state.name}' needs 'next': where it leads to"
            yield codes.OPEN_OUTCOME.at(state.span, message, help=f"it can end with {_listed(words)}")
        return
    if "" in leads_to.to:
        if ends.counting_as(FAILS):
            message = f"the state '{state.name}' can fail, so that one word after 'next' is not enough"
            yield codes.OPEN_OUTCOME.at(leads_to.spans[""], message, help=ONE_WORD)
        return
    handled = leads_to.to
    for word, counts_as in words.items():
        if word not in handled and counts_as not in handled:
            message = f"the state '{state.name}' can end with '{word}', which leads nowhere"
            yield codes.OPEN_OUTCOME.at(state.span, message, help=f"write '{word}: ...' under 'next'")
    counted = {counts_as for word, counts_as in words.items() if word not in handled}
    for outcome in handled:
        if outcome not in words and outcome not in counted:
            message = f"the state '{state.name}' never ends with '{outcome}'"
            span = leads_to.keys.get(outcome, state.span)
            yield codes.UNKNOWN_OUTCOME.misspelt(span, message, outcome, words, "its outcomes", taken=handled)


def _targets(state: Node, leads_to: Next | None, options: MachineOptions) -> Iterator[Finding]:
    if leads_to is None:
        return
    known = (*options.states, *options.ends)
    for outcome, to in leads_to.to.items():
        if to not in known:
            message = f"there is no state or end '{to}'"
            yield codes.UNKNOWN_STATE.misspelt(leads_to.spans[outcome], message, to, known, "states and ends")


def _listed(words: Iterable[str]) -> str:
    return " or ".join(f"'{word}'" for word in words)
