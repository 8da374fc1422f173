"""All that a kind of mission node or a modifier imports."""

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.evaluate import evaluate, holds
from rbxcompose.base.expressions.text import Template, condition_in_words
from rbxcompose.base.expressions.tree import Expression, Number
from rbxcompose.base.expressions.types import UNKNOWN, Type, TypeKind
from rbxcompose.base.expressions.values import NotArrivedError, Value
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.analysis.facts import is_simple, is_sure, takes_time
from rbxcompose.missions.engine.events import Logged, Reported, SkillEnded, SkillStarted, Transition
from rbxcompose.missions.engine.instant_actions import act, act_safely, fields_of
from rbxcompose.missions.engine.leaf import Leaf
from rbxcompose.missions.engine.task import MovedChildren, Site, Task
from rbxcompose.missions.engine.world import Watched
from rbxcompose.missions.language.asked import WrittenArgument
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
from rbxcompose.missions.language.written import PLACED, Getter, getter, place
from rbxcompose.missions.modifiers.registry import Decorator, modifier
from rbxcompose.missions.program.answers import (
    LEVELS,
    NO_EFFECTS,
    PLAIN,
    Advice,
    Form,
    ModifierScope,
    NodeEffects,
    NodeFlow,
    NodeLook,
    Possibility,
    Skipped,
    WrittenSetting,
    ended,
    led,
    started,
)
from rbxcompose.missions.program.families import Choosing, Deed, GroupStep, LeafStep, Loop, Straight, ends
from rbxcompose.missions.program.in_turn import RANDOM, InTurn, InTurnTask, WithHistory
from rbxcompose.missions.program.machines import MessageTemplate
from rbxcompose.missions.program.modifier import Acting, Modifier, Plain, Skipping
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
from rbxcompose.missions.program.program import Endings, MissionNode, RobotNames, Step, Target
from rbxcompose.missions.program.registry import kind
from rbxcompose.missions.program.sentences import (
    argument_in_words,
    logged_in_words,
    says,
    set_in_words,
    spoken,
    times_in_words,
)
