"""A mission waits for what people send, and an old message would end the wait."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.expressions.tree import Expression, Junction, Variable, new_names
from rbxcompose.expressions.types import FLAG
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING


@check("RBX4181", Severity.WARNING, closed=(WIRING,))
def stale_event(robot: Robot) -> Iterator[Finding]:
    """An old message would end a wait at once."""
    doubtful = [name for name in robot.values if _may_be_stale(robot, name)]
    for mission in robot.missions.values() if doubtful else ():
        own = {*mission.program.data, *mission.program.inputs}
        for node in mission.program.nodes:
            for asked in node.asked if node.step.only_asks else ():
                wanted = _wanted(asked.expression) if asked.is_watched else ()
                for name in (name for name in wanted if name in doubtful and name not in own):
                    doubtful.remove(name)
                    place = Related(robot.key("values", name), "the value")
                    message = f"the last message of '${name}' ends this wait, however old it is"
                    help_text = f"write 'event: true' at the value '{name}', or 'event: false' if it tells a state"
                    yield stale_event.at(asked.scalar.span, message, help=help_text, related=[place])


def _may_be_stale(robot: Robot, name: str) -> bool:
    """Return whether a value is a flag from outside whose nature is not told."""
    entry, source = robot.manifest.values[name], robot.values[name]
    is_outside = entry.topic is not None and source.topic not in robot.writers
    return is_outside and source.type == FLAG and entry.event is None


def _wanted(condition: Expression) -> list[str]:
    """Return the flags whose last messages may make a condition hold."""
    tree, fresh = condition.tree, new_names(condition)
    operands = tree.operands if isinstance(tree, Junction) else (tree,)
    return [one.name for one in operands if isinstance(one, Variable) and one.name not in fresh]
