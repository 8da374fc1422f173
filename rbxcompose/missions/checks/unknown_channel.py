"""Topics and services that the robot does not have."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rbxcompose.findings import Finding
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.effects import called, published
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.program.messages import MessageTemplate
from rbxcompose.rules import NAMES, WIRING


@mission_check("RBX4150", is_fixable=True, closed=(WIRING, NAMES))
def unknown_channel(mission: Examined) -> Iterator[Finding]:
    """A mission uses a topic or a service that the robot does not have."""
    for node in mission.program.nodes:
        for message in published(node):
            yield from _nowhere(message, "topic", mission.robot.topics)
        for message in called(node):
            if (name := message.target.text) in mission.robot.skills and name not in mission.robot.services:
                told = f"'{name}' is a skill, and no service"
                yield unknown_channel.at(message.target.span, told, help=f"write it as a step of its own: '- {name}'")
                continue
            yield from _nowhere(message, "service", mission.robot.services)


def _nowhere(message: MessageTemplate, what: str, known: Mapping[str, str]) -> Iterator[Finding]:
    name = message.target.text
    if name and name not in known:
        told = f"the robot has no {what} '{name}'"
        yield unknown_channel.misspelt(message.target.span, told, name, known, f"{what}s of this robot")
