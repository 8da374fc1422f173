"""A parsed mission: a flat, frozen tuple of nodes, and the rest of its file."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import field
from functools import cached_property, partial
from typing import ClassVar, Protocol

from rbxcompose.base.config import Place
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.check import StaticScope
from rbxcompose.base.expressions.text import parse_template
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.base.expressions.types import Type
from rbxcompose.base.expressions.values import Value
from rbxcompose.base.findings import Span
from rbxcompose.manifest.tree import MappingNode, ScalarNode
from rbxcompose.missions.engine.world import show
from rbxcompose.missions.language.fields import Declared
from rbxcompose.missions.language.grammar import NO_HISTORY
from rbxcompose.missions.program import parts
from rbxcompose.missions.program.outcomes import Outcomes
from rbxcompose.msgs.fields import ArrayEntries, NumberRange


class Modifier(Declared, ABC):
    """A setting of a node, with its options; only some modifiers override what is not abstract."""

    __slots__ = ()
    only_states: ClassVar[bool]  # it is for states of machines only

    @abstractmethod
    def changed(self, inner: Outcomes) -> Outcomes:
        """Return the outcomes of a node with this modifier; `inner` are those without it."""

    @property
    @abstractmethod
    def may_skip(self) -> bool:
        """Return whether it may keep the node from starting."""

    @property
    @abstractmethod
    def serves(self) -> parts.ModifierScope:
        """Return which nodes it is meant for."""

    @property
    @abstractmethod
    def value(self) -> Expression | None:
        """Return the expression behind its key."""

    @abstractmethod
    def clause(self) -> str:
        """Return what it adds to the sentence of its node, read aloud: 'for at most 30 s'; empty for nothing."""

    @property
    def said(self) -> str:
        """Return the text to draw behind its key."""
        return self.value.text if self.value else ""

    @property
    def repeats(self) -> bool:
        """Return whether it may start the node inside more than once."""
        return False

    @property
    def endless(self) -> parts.Advice | None:
        """Return the advice to give if the node inside takes no time."""
        return None

    @property
    def limit(self) -> Expression | None:
        """Return the time limit of the node."""
        return None

    @property
    def attempt_limit(self) -> Expression | None:
        """Return the time limit of each attempt."""
        return None

    @property
    def forgives(self) -> bool:
        """Return whether a failure may count as success."""
        return False

    @property
    def saved(self) -> ScalarNode | None:
        """Return the name under which the result is saved."""
        return None

    @property
    def moments(self) -> parts.Moments | None:
        """Return what its hooks do."""
        return None


ROOT = 0  # number of the node under `do`
RATE = 20.0  # [Hz] for polling conditions that change without a message
NOTHING: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class Skill:
    """What a mission may request of the robot: typed arguments in order, and the `main` one that a single value fills.

    `outcomes` are those besides `success` and `failure`, each with which of the two it counts as. `claims` is what it
    needs exclusively (base, arm, head, voice), empty for nothing. `results` are the types of its result values.
    `entries` are arguments among which at least one must be given, or the main one, or the one that may stand instead.
    `ranges` are what numbers may be.
    """

    name: str
    arguments: Mapping[str, Type] = field(default_factory=dict)
    main: str = ""
    required: frozenset[str] = frozenset()
    claims: str = ""
    restartable: bool = True
    pausable: bool = False
    outcomes: Mapping[str, str] = field(default_factory=dict)
    results: Mapping[str, Type] = field(default_factory=dict)
    entries: ArrayEntries | None = None
    ranges: Mapping[str, NumberRange] = field(default_factory=dict)

    def mistake_in(self, argument: str, value: Value) -> str:
        """Return why a number is not within the range of an argument; nothing if it is, or there is none."""
        allowed, shown = self.ranges.get(argument), partial(show, self.arguments.get(argument))
        if allowed is None or not isinstance(value, int | float) or allowed.holds(value):
            return ""
        return f"the {argument} must be {allowed.phrase(shown)}, not {shown(value)}"


@dataclass(frozen=True, slots=True)
class RobotNames:
    """What the robot offers every mission: types of its values, its places, its skills, its missions, all by name.

    `events` are the values whose messages are events; `settings` are those of components that may change, by component;
    `topics` and `services` have the ROS names of their types; `unread` are missions whose files could not be read;
    `removed` are places that a layer has removed, each with where. It is not complete if a part has errors.
    """

    values: Mapping[str, Type] = field(default_factory=dict)
    places: Mapping[str, Place] = field(default_factory=dict)
    skills: Mapping[str, Skill] = field(default_factory=dict)
    missions: Mapping[str, Program] = field(default_factory=dict)
    topics: Mapping[str, str] = field(default_factory=dict)
    services: Mapping[str, str] = field(default_factory=dict)
    settings: Mapping[str, Mapping[str, Type]] = field(default_factory=dict)
    unread: frozenset[str] = frozenset()
    removed: Mapping[str, Span] = field(default_factory=dict)
    is_complete: bool = True
    events: frozenset[str] = NOTHING
    may_have: Callable[[str, str], bool] = lambda kind, name: False
    """Returns whether something of a kind may have a name, though it was not found: where it should be is a mistake."""
    ends: dict[str, Outcomes] = field(init=False, compare=False, repr=False, default_factory=dict)
    """How its missions may end, as far as that was asked: one that many others use is examined once."""
    claims: dict[str, frozenset[str]] = field(init=False, compare=False, repr=False, default_factory=dict)
    """What its missions claim, as far as that was asked."""


class Endings(Protocol):
    """An analyser of how the nodes of a mission may end."""

    program: Program
    robot: RobotNames

    @property
    def constants(self) -> Mapping[str, Value]:
        """Return the data that nothing changes."""

    def of(self, number: int, /) -> Outcomes:
        """Return how a node may end, its modifiers included."""

    def of_mission(self, name: str, /) -> Outcomes:
        """Return how another mission may end."""


class Step(Declared, ABC):
    """What a node does: a kind of the language with its options, which are the fields of the subclass.

    Every kind answers what is abstract, itself or through its family (`families.py`). The rest are capabilities: a
    kind without one keeps the default.
    """

    __slots__ = ()
    is_inner: ClassVar[bool]  # it occurs only inside another one, like a state in a machine: it has no word
    result_names: ClassVar[tuple[str, ...]] = ()  # entries of its result, if these are always the same

    @abstractmethod
    def may_end(self, node: MissionNode, endings: Endings) -> Outcomes:
        """Return how it may end, without its modifiers."""

    @abstractmethod
    def possibilities(
        self, node: MissionNode, nodes: tuple[MissionNode, ...], robot: RobotNames
    ) -> Iterator[parts.Possibility]:
        """Yield what it may do, as far as tests should cover it."""

    @abstractmethod
    def shows(self, node: MissionNode, scope: StaticScope) -> Mapping[str, Type]:
        """Return the names that only the nodes inside see, with their types."""

    @abstractmethod
    def endless(self, ends: Outcomes) -> parts.Advice | None:
        """Return the advice to give if it runs for ever without a pause; `ends` is how it may end."""

    @property
    @abstractmethod
    def skipped(self) -> parts.Skipped:
        """Return when it does nothing."""

    @property
    @abstractmethod
    def only_asks(self) -> bool:
        """Return whether by itself it only evaluates conditions, which may be repeated at any time."""

    @property
    @abstractmethod
    def waits(self) -> bool:
        """Return whether it takes time by itself."""

    @property
    @abstractmethod
    def comes_again(self) -> bool:
        """Return whether its children may run more than once."""

    @property
    @abstractmethod
    def effects(self) -> parts.NodeEffects:
        """Return the effects that it has by itself."""

    @property
    @abstractmethod
    def has_result(self) -> bool:
        """Return whether it has something that `save` keeps."""

    @property
    @abstractmethod
    def flow(self) -> parts.NodeFlow:
        """Return how it goes through its children."""

    @property
    @abstractmethod
    def look(self) -> parts.NodeLook:
        """Return how it is drawn."""

    @abstractmethod
    def sentence(self, node: MissionNode, robot: RobotNames) -> str:
        """Return what it does, read aloud: 'Wait 5 s'; its children say what is below it."""

    def before(self, index: int) -> str:
        """Return the words before the sentence of one of its children: 'Otherwise'; empty for none."""
        return ""

    @property
    def word(self) -> str:
        """Return what people call it: the word of the language, or the name of a skill."""
        return self.name

    def text(self, node: MissionNode) -> str:
        """Return the text to draw in it: its own expressions."""
        return ", ".join(asked.scalar.text for asked in node.asked[: min(node.own, 2)])

    @property
    def skill(self) -> str:
        """Return the skill that it runs; empty for none."""
        return ""

    @property
    def ends_mission(self) -> str:
        """Return the result with which it ends its mission; empty if it does not end it."""
        return ""

    @property
    def uses(self) -> ScalarNode | None:
        """Return the name of the mission that it runs."""
        return None

    @property
    def arguments(self) -> tuple[parts.WrittenArgument, ...]:
        """Return the arguments for its skill or mission."""
        return ()

    @property
    def reads(self) -> frozenset[str]:
        """Return the `$names` that it reads besides its expressions, messages and arguments."""
        return NOTHING

    @property
    def lasts(self) -> Expression | None:
        """Return the time that it takes; of a loop, that from the start of one round to the start of the next."""
        return None

    @property
    def history(self) -> str:
        """Return where it resumes after it was halted, as a word of `HISTORIES`."""
        return NO_HISTORY

    @property
    def goes_on_after(self) -> str:
        """Return the result of a child after which the next one runs, if they run in order."""
        return ""

    @property
    def items(self) -> Expression | tuple[Expression, ...] | None:
        """Return what it iterates over."""
        return None

    @property
    def rounds(self) -> Expression | None:
        """Return how often it goes through its children, if it comes again and a number says so."""
        return None

    @property
    def choice(self) -> parts.BranchChoice | None:
        """Return the value and the cases by which it chooses one of its children."""
        return None

    @property
    def branches(self) -> parts.Branches | None:
        """Return what decides how it ends, if its children run in parallel."""
        return None

    @property
    def states(self) -> parts.MachineStates | None:
        """Return its states, if its children are states."""
        return None

    @property
    def leads_to(self) -> parts.Next | None:
        """Return where a state leads to."""
        return None


@dataclass(frozen=True, slots=True)
class MissionNode:
    """One mission node. The nodes below it have the numbers from `number + 1` to `end` (exclusive).

    `step` is what it does; `modifiers` are by key, from the outside in. `asked` are all expressions, for checking; the
    first `own` of them belong to the step itself. `item` is the name that a loop gives to its item. `held` is where in
    the data a node executed by a `run` is. `inner` is the mission that a `use` runs, in a linked program: its nodes are
    below this one.
    """

    number: int
    step: Step
    name: str
    path: str
    span: Span
    parent: int | None
    children: tuple[int, ...]
    end: int
    modifiers: Mapping[str, Modifier] = field(default_factory=dict)
    asked: tuple[parts.Asked, ...] = ()
    own: int = 0
    item: str = ""
    held: tuple[str, ...] = ()
    inner: Program | None = None

    @property
    def skill(self) -> str:
        """Return the skill that it runs; empty for none."""
        return self.step.skill

    @property
    def saved(self) -> ScalarNode | None:
        """Return the name under which it saves its result."""
        return next((modifier.saved for modifier in self.modifiers.values() if modifier.saved), None)

    @property
    def limit(self) -> Expression | None:
        """Return its time limit."""
        return next((modifier.limit for modifier in self.modifiers.values() if modifier.limit), None)

    @property
    def attempt_limit(self) -> Expression | None:
        """Return the time limit of each of its attempts."""
        return next((modifier.attempt_limit for modifier in self.modifiers.values() if modifier.attempt_limit), None)

    @property
    def may_be_left_out(self) -> bool:
        """Return whether a modifier may keep it from starting."""
        return any(modifier.may_skip for modifier in self.modifiers.values())

    @property
    def comes_again(self) -> bool:
        """Return whether it may run its children, or a modifier it, more than once."""
        return self.step.comes_again or any(modifier.repeats for modifier in self.modifiers.values())

    @property
    def is_forgiven(self) -> bool:
        """Return whether its failure may count as success."""
        return any(modifier.forgives for modifier in self.modifiers.values())


CONTINUE, RESTART, END = "continue", "restart", "end"
AFTERWARDS = (CONTINUE, RESTART, END)  # the default first


@dataclass(frozen=True, slots=True)
class Target:
    """What an interrupt restarts: a node or state, or the current round of a loop."""

    number: int
    is_round: bool = False


@dataclass(frozen=True, slots=True)
class Interrupt:
    """A condition that interrupts the mission, and the node that then runs (None: nothing).

    `afterwards` is a word of `AFTERWARDS`; `targets` are all nodes that a restart by name may mean; those that are
    running restart.
    """

    name: str
    when: parts.Asked
    root: int | None
    afterwards: str
    span: Span
    restarts: ScalarNode | None = None
    targets: tuple[Target, ...] = ()


@dataclass(frozen=True)
class Program:
    """A mission: its main node has the number `main`, which is 0 unless it is part of a linked program.

    The nodes of the interrupts follow. `outputs` are what it returns to a mission that uses it. `root` is the tree it
    was read from; everything else follows from that. It is open if some of its own names could not be read.
    """

    name: str
    about: str
    file: str
    nodes: tuple[MissionNode, ...]
    inputs: Mapping[str, parts.Input] = field(default_factory=dict)
    data: Mapping[str, parts.Datum] = field(default_factory=dict)
    interrupts: tuple[Interrupt, ...] = ()
    rate: float = RATE
    outputs: Mapping[str, parts.Asked] = field(default_factory=dict)
    main: int = ROOT
    root: MappingNode = field(default_factory=MappingNode, repr=False)
    is_open: bool = False

    def asked(self) -> Iterator[tuple[MissionNode | None, parts.Asked]]:
        """Yield all expressions, each with its node; None for an interrupt or an output."""
        for node in self.nodes:
            for asked in node.asked:
                yield node, asked
        for interrupt in self.interrupts:
            yield None, interrupt.when
        for asked in self.outputs.values():
            yield None, asked

    def below(self, number: int) -> tuple[MissionNode, ...]:
        """Return a node and all below it."""
        return self.nodes[number : self.nodes[number].end]

    @cached_property
    def saved(self) -> frozenset[str]:
        """Return the names under which results are saved."""
        return frozenset(node.saved.text for node in self.nodes if node.saved)

    @cached_property
    def items(self) -> frozenset[str]:
        """Return the names that loops give to their items."""
        return frozenset(node.item for node in self.nodes)

    @cached_property
    def reads(self) -> frozenset[str]:
        """Return all `$names` that are read anywhere, including in arguments of skills and missions."""
        read = {name.name for _, asked in self.asked() for name in asked.expression.names}
        for node in self.nodes:
            step, messages = node.step, (node.step.effects.published, node.step.effects.called)
            read.update(step.reads, *(message.names for message in messages if message))
            read.update(*(modifier.moments.names for modifier in node.modifiers.values() if modifier.moments))
            scalars = (argument.value for argument in step.arguments if isinstance(argument.value, ScalarNode))
            read.update(name.name for scalar in scalars for name in parse_template(scalar.text).names)
        return frozenset(read)
