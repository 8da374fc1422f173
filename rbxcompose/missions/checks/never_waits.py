"""Loops without an end that take no time."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.tree import Expression, Number
from rbxcompose.findings import Finding, Severity
from rbxcompose.missions.checking import mission_check
from rbxcompose.missions.examined import Examined
from rbxcompose.missions.kinds.repeat import RepeatOptions
from rbxcompose.missions.machines import MachineOptions
from rbxcompose.missions.modifiers.limits import Tries


@mission_check("RBX4107", Severity.WARNING)
def never_waits(mission: Examined) -> Iterator[Finding]:
    """A loop without an end never waits

    Nothing in the body takes time, so the loop would run as fast as it can. The engine slows it down to the mission's
    rate.

    Bad:

    ```yaml
    do:
      repeat: forever
      do:
        check: $battery < 30 %
    ```

    Good:

    ```yaml
    do:
      repeat: forever
      every: 1 s
      do:
        check: $battery < 30 %
    ```
    """
    for view in mission.views:
        node, tries = view.node, view.node.modifiers.get("attempts")
        if view.waits:
            continue
        if isinstance(node.options, RepeatOptions) and node.options.rounds is None:
            help_text = "give it 'every: 1 s', or a 'wait' in its body"
            yield never_waits.at(node.span, "this loop never waits", help=help_text)
        if isinstance(tries, Tries) and tries.most is None and not _takes_time(tries.pause):
            help_text = "give it a number of attempts, or an 'attempt_pause'"
            yield never_waits.at(node.span, "what is tried for ever never waits", help=help_text)
        if isinstance(node.options, MachineOptions) and not mission.ending.of(node.number).words:
            help_text = "put a 'wait' into a state, or lead to an end"
            yield never_waits.at(node.span, "this machine never ends and never waits", help=help_text)


def _takes_time(pause: Expression | None) -> bool:
    return pause is not None and not (isinstance(pause.tree, Number) and pause.tree.value == 0)
