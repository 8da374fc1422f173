"""What counts for a node only from its start: events, and what it asks by `new($x)`."""

from __future__ import annotations

from collections.abc import Sequence

from rbxcompose.expressions.tree import new_names
from rbxcompose.expressions.types import FLAG
from rbxcompose.expressions.values import NOT_ARRIVED
from rbxcompose.missions.engine.scopes import MissionScope, SinceScope
from rbxcompose.missions.language.asked import Asked
from rbxcompose.missions.program.program import Program, RobotNames


def since_scope(outer: MissionScope, asked: Sequence[Asked], robot: RobotNames, program: Program) -> SinceScope:
    """Return the scope of what asks for these; a flag that is an event is false until it comes."""
    names = frozenset[str]().union(*(new_names(one.expression) for one in asked))
    read = {name.name for one in asked if one.is_watched for name in one.expression.names}
    events = (read & robot.events) - {*program.data, *program.inputs}
    return SinceScope(outer, names, {name: False if robot.values[name] == FLAG else NOT_ARRIVED for name in events})
