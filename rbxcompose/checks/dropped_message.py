"""Velocities that a mission publishes and every base drops."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.missions.analysis.effects import published
from rbxcompose.missions.analysis.facts import number_of
from rbxcompose.missions.program.messages import TemplateShape, WrittenValue
from rbxcompose.model.charge import constants
from rbxcompose.model.robot import Robot
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.rules import NAMES, WIRING
from rbxcompose.sdk.capabilities import Drives, Setting
from rbxcompose.units import ANGULAR_SPEED, SPEED, format_quantity

_FIELDS = {("linear", "x"): ("max_speed", SPEED, "m/s"), ("angular", "z"): ("max_turn_rate", ANGULAR_SPEED, "rad/s")}


@check("RBX4172", closed=(WIRING, NAMES))
def dropped_message(robot: Robot) -> Iterator[Finding]:
    """A mission publishes a velocity that the base ignores."""
    limits = {key: _dropped_above(robot, name) for key, (name, _, _) in _FIELDS.items()}
    for mission in robot.missions.values() if not all(map(math.isinf, limits.values())) else ():
        sent = (message for node in mission.program.nodes for message in published(node))
        for message in sent:
            topic = robot.topics.get(message.target.text)
            for (outer, inner), limit in limits.items() if topic and topic.message == Twist.TYPE else ():
                written = _at(_at(message.body, outer), inner)
                value = _number(written, constants(mission))
                if isinstance(written, WrittenValue) and value is not None and abs(value) > limit:
                    _, dimension, unit = _FIELDS[outer, inner]
                    most, is_turn = format_quantity(limit, dimension, unit), dimension is ANGULAR_SPEED
                    yield dropped_message.at(
                        written.scalar.span,
                        f"the base ignores commands above {most}, and this is {value:g} {unit}",
                        help=f"for {value:g} deg/s, write {math.radians(value):.3g}" if is_turn else "",
                    )


def _dropped_above(robot: Robot, name: str) -> float:
    """Return above which velocity every base ignores a command, infinite if one does not."""
    found = [math.inf]
    for _, drives in robot.declared(Drives):
        limit: Setting[float] | None = getattr(drives, name)
        found.append(limit.value * drives.drops_above.value if limit and drives.drops_above else math.inf)
    return max(found[1:], default=math.inf)


def _at(shape: TemplateShape | None, key: str) -> TemplateShape | None:
    return shape.get(key) if isinstance(shape, Mapping) else None


def _number(shape: TemplateShape | None, known: Mapping[str, object]) -> float | None:
    return number_of(shape.expression, known) if isinstance(shape, WrittenValue) else None
