"""All that a kind of mission node or a modifier imports."""

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.evaluate import evaluate, holds
from rbxcompose.base.expressions.text import Template
from rbxcompose.base.expressions.tree import Expression
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
from rbxcompose.missions.modifiers.registry import Decorator, modifier
from rbxcompose.missions.program.answers import (
    Advice,
    ModifierScope,
    NodeEffects,
    NodeFlow,
    NodeLook,
    Possibility,
    Skipped,
    started,
)
from rbxcompose.missions.program.families import Choosing, Deed, GroupStep, LeafStep, Loop, Straight, ends
from rbxcompose.missions.program.modifier import Modifier, Plain, Skipping
from rbxcompose.missions.program.outcomes import (
    ALWAYS_FAILS,
    ALWAYS_SUCCEEDS,
    ANY,
    FAILURE,
    NEVER,
    RUNNING,
    SKIPPED,
    SUCCESS,
    NodeFailed,
    Outcomes,
    either,
)
from rbxcompose.missions.program.program import Endings, MissionNode, RobotNames, Step
from rbxcompose.missions.program.registry import kind
