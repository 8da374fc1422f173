"""Conditions on events that are evaluated only once, when nothing can have come yet."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.types import FLAG
from rbxcompose.findings import Finding
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined


@mission_check("RBX4180")
def event_at_once(mission: Examined) -> Iterator[Finding]:
    """A condition on an event is evaluated only once."""
    program = mission.program
    events = mission.robot.events - {*program.data, *program.inputs}
    for node in program.nodes if events else ():
        for asked in node.asked:
            if asked.wanted == FLAG and not asked.is_watched and not asked.is_assigned:
                for name in sorted({name.name for name in asked.expression.names} & events):
                    message = f"nothing of '${name}' can have come since this node began: it asks at that moment"
                    yield event_at_once.at(asked.scalar.span, message, help="wait for it: 'wait_for', with a 'timeout'")
