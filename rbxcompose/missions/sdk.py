"""All that a kind of mission node or a modifier imports."""

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.evaluate import evaluate, holds
from rbxcompose.base.expressions.text import Template, condition_in_words
from rbxcompose.base.expressions.tree import Expression, Number
from rbxcompose.base.expressions.types import PLACED, UNKNOWN, Type, TypeKind
from rbxcompose.base.expressions.values import NotArrivedError, Value
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.analysis.facts import is_simple, is_sure, takes_time
from rbxcompose.missions.engine.events import Logged, Reported, SkillEnded, SkillStarted, Transition
from rbxcompose.missions.engine.instant_actions import Getter, act, act_safely, fields_of, getter, place
from rbxcompose.missions.engine.task import Leaf, MovedChildren, Site, Task
from rbxcompose.missions.engine.world import Watched
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
from rbxcompose.missions.language.grammar import Takes
from rbxcompose.missions.language.node_reader import NodeReader
from rbxcompose.missions.program.families import (
    RANDOM,
    Acting,
    Choosing,
    Decorator,
    Deed,
    GroupStep,
    InTurn,
    InTurnTask,
    LeafStep,
    Loop,
    Plain,
    Skipping,
    Straight,
    WithHistory,
    argument_in_words,
    ends,
    logged_in_words,
    says,
    set_in_words,
    spoken,
    times_in_words,
)
from rbxcompose.missions.program.outcomes import (
    ALWAYS_FAILS,
    ALWAYS_SUCCEEDS,
    ANY,
    FAILS,
    FAILURE,
    IDLE,
    NAMES,
    NEVER,
    RUNNING,
    SKIPPED,
    SUCCEEDS,
    SUCCESS,
    NodeFailed,
    Outcomes,
    Result,
    either,
)
from rbxcompose.missions.program.parts import (
    LEVELS,
    NO_EFFECTS,
    PLAIN,
    Advice,
    Form,
    MessageTemplate,
    ModifierScope,
    NodeEffects,
    NodeFlow,
    NodeLook,
    Possibility,
    Skipped,
    WrittenArgument,
    WrittenSetting,
    ended,
    led,
    started,
)
from rbxcompose.missions.program.program import Endings, MissionNode, Modifier, RobotNames, Step, Target
from rbxcompose.missions.program.registry import kind, modifier
