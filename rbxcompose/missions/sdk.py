"""All that a kind of mission node or a modifier imports."""

from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.evaluate import evaluate, holds
from rbxcompose.expressions.text import Template
from rbxcompose.expressions.tree import Expression
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.engine.events import Logged
from rbxcompose.missions.engine.leaf import Leaf
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.language.fields import (
    assignments,
    branch,
    branches,
    cases,
    child,
    children,
    choice,
    condition,
    contents,
    count,
    count_or_forever,
    duration,
    flag,
    history,
    hook,
    inputs,
    item_name,
    items,
    kept,
    message,
    new_name,
    record,
    text,
    value,
    watched,
    word,
)
from rbxcompose.missions.modifiers.families import Plain, Skipping
from rbxcompose.missions.modifiers.registry import Decorator, modifier
from rbxcompose.missions.program.answers import Advice, ModifierScope, NodeFlow, Skipped
from rbxcompose.missions.program.families import Choosing, Deed, GroupStep, LeafStep, Loop, Straight, ends
from rbxcompose.missions.program.look import NodeLook
from rbxcompose.missions.program.modifier import Modifier
from rbxcompose.missions.program.moments import NodeEffects
from rbxcompose.missions.program.outcomes import ALWAYS_FAILS, ALWAYS_SUCCEEDS, ANY, NEVER, Outcomes, either
from rbxcompose.missions.program.possible import Possibility, started
from rbxcompose.missions.program.program import Endings, MissionNode, RobotNames, Step
from rbxcompose.missions.program.registry import kind
from rbxcompose.missions.program.results import NodeFailed
from rbxcompose.missions.program.statuses import FAILURE, RUNNING, SKIPPED, SUCCESS
