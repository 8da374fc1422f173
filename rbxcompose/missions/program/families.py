"""What the kinds and modifiers of a family have in common, and how they say what they do."""

from __future__ import annotations

import re
from abc import abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Any, ClassVar, Self

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.check import StaticScope
from rbxcompose.base.expressions.text import Template, condition_in_words, in_words, plain_name
from rbxcompose.base.expressions.tree import Expression, ExpressionError, Number
from rbxcompose.base.expressions.types import FLAG, TEXT, UNKNOWN, Type
from rbxcompose.manifest.tree import MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions.engine.task import MovedChildren, Site, Task
from rbxcompose.missions.engine.world import Watched
from rbxcompose.missions.language.fields import children, choice, flag, history
from rbxcompose.missions.language.grammar import DEEP, NO_HISTORY
from rbxcompose.missions.language.node_reader import NodeReader
from rbxcompose.missions.program import outcomes, parts
from rbxcompose.missions.program.outcomes import FAILURE, IDLE, RUNNING, SKIPPED  # looked up in every tick
from rbxcompose.missions.program.program import Endings, MissionNode, Modifier, RobotNames, Step

_SLOT = re.compile(r"\{(\w+)(:if)?\}")


def says(template: str) -> Any:
    """Return the sentence of a kind, or of a modifier, in which `{field}` is a field in words.

    `{field:if}` is one that holds a condition, as it follows 'if'.
    """

    def sentence(declared: object, *_: object) -> str:
        def filled(slot: re.Match[str]) -> str:
            value = getattr(declared, slot[1])
            is_condition = bool(slot[2]) and isinstance(value, Expression)
            return condition_in_words(value) if is_condition else spoken(value)

        return _SLOT.sub(filled, template)

    return sentence


def spoken(value: object) -> str:
    """Return what is written in a field, in words."""
    match value:
        case Expression():
            return in_words(value)
        case Template(text=text):
            return quoted(text)
        case ScalarNode(text=text) | str(text):
            return plain_name(text)
    return str(value)


def times_in_words(count: Expression) -> str:
    """Return how often, in words: '3 times'."""
    if isinstance(count.tree, Number):
        return "once" if count.tree.value == 1 else f"{count.text} times"
    return f"as many times as {in_words(count)}"


def quoted(text: str) -> str:
    """Return a text in quotes, on one line."""
    return f"'{' '.join(text.split())}'"


def deeds_in_words(deeds: parts.Deeds) -> str:
    """Return what is set, logged and published, in words."""
    message = f"publish on {deeds.message.target.text}" if deeds.message else ""
    log = logged_in_words(deeds.text, deeds.level) if deeds.text else ""
    return ", ".join(filter(None, (set_in_words(deeds.assignments), log, message)))


def set_in_words(assignments: tuple[parts.Assignment, ...]) -> str:
    """Return what is set to what, in words."""
    one_by_one = [f"{spoken(one.name)} to {argument_in_words(one.asked.scalar)}" for one in assignments]
    return f"set {', '.join(one_by_one)}" if one_by_one else ""


def logged_in_words(text: Template, level: str) -> str:
    """Return what is logged, in words."""
    how = {"warn": " as a warning", "error": " as an error"}
    return f"log {spoken(text)}{how.get(level, '')}"


def argument_in_words(value: TreeNode, wanted: Type = UNKNOWN) -> str:
    """Return an argument in words: a text in quotes, else its value."""
    match value:
        case ScalarNode() if wanted == TEXT:
            return quoted(value.text)
        case ScalarNode():
            try:
                expression = parts.expression_of(value)
            except ExpressionError:
                return quoted(value.text)
            return condition_in_words(expression) if wanted == FLAG and expression.names else in_words(expression)
        case SequenceNode(items=items):
            return ", ".join(map(argument_in_words, items))
        case MappingNode(entries=entries):
            said = (f"{plain_name(key)} {argument_in_words(one.value)}" for key, one in entries.items())
            return ", ".join(said) or "nothing"


def ends(how: outcomes.Outcomes) -> Any:
    """Return the `may_end` of a kind that may end in these ways wherever it is written."""

    def may_end(step: Step, node: MissionNode, endings: Endings) -> outcomes.Outcomes:
        return how

    return may_end


class Quiet(Step):
    """A kind that by itself shows its children no names, changes nothing, and does nothing that tests should cover."""

    __slots__ = ()

    def possibilities(
        self, node: MissionNode, nodes: tuple[MissionNode, ...], robot: RobotNames
    ) -> Iterator[parts.Possibility]:
        """Yield nothing: what is around it covers whether it starts, and how often it repeats depends on data."""
        yield from ()

    def shows(self, node: MissionNode, scope: StaticScope) -> Mapping[str, Type]:
        """Return nothing: its children, if it has any, see what it sees."""
        return {}

    @property
    def effects(self) -> parts.NodeEffects:
        """Return no effects."""
        return parts.NO_EFFECTS


class LeafStep(Quiet):
    """A node without children: it does one thing once."""

    __slots__ = ()
    skipped = parts.Skipped.NEVER
    comes_again = False
    flow = parts.NodeFlow.IN_TURN
    look = parts.PLAIN

    def endless(self, ends: outcomes.Outcomes) -> None:
        """Return nothing: it runs once."""

    @property
    @abstractmethod
    def lasts(self) -> Expression | None:
        """Return the time that it takes, if the mission says so."""


class Deed(LeafStep):
    """A leaf that does something and ends immediately."""

    __slots__ = ()
    waits = False
    only_asks = False
    has_result = False
    lasts = None


class GroupStep(Quiet):
    """A node that does nothing by itself: its children do the work, and see what it sees."""

    __slots__ = ()
    only_asks = False  # it decides more than the answer to a condition
    has_result = False  # only its children have results

    @property
    def waits(self) -> bool:
        """Return False: only its children take time."""
        return False


class Straight(GroupStep):
    """A group that goes through its children once; tests need not see more of it than that."""

    __slots__ = ()

    @property
    def comes_again(self) -> bool:
        """Return False: it goes through its children once."""
        return False

    def endless(self, ends: outcomes.Outcomes) -> None:
        """Return nothing: it runs once."""


class Loop(GroupStep):
    """A group that may repeat its children, or do nothing at all."""

    __slots__ = ()
    comes_again = True
    skipped = parts.Skipped.PERHAPS


class Choosing(Straight):
    """A group that runs one of its children, or none."""

    __slots__ = ()
    skipped = parts.Skipped.PERHAPS
    flow = parts.NodeFlow.ONE_OF
    look = parts.NodeLook(form=parts.Form.BESIDE, has_roles=True)

    @property
    @abstractmethod
    def ways(self) -> tuple[str, ...]:
        """Return its alternatives in words, in the order of its children; the last may be that none of them runs."""

    def possibilities(
        self, node: MissionNode, nodes: tuple[MissionNode, ...], robot: RobotNames
    ) -> Iterator[parts.Possibility]:
        """Yield each child, and the case that nothing fits."""
        for index, word in enumerate(self.ways):
            if index < len(node.children):
                yield parts.Possibility(node.span, f"{node.path}: {word}", parts.started(node.children[index]))
            else:
                yield parts.Possibility(node.span, f"{node.path}: nothing fits", parts.skipped(node.number))


class WithHistory(Task):
    """A task that may have a history; kinds set `history` and call `engine.places.take_up` when they begin."""

    __slots__ = ("history",)
    history: str
    is_kept_after_failure: ClassVar[bool] = False

    def halt(self) -> None:
        """Stop what runs, and keep the place."""
        places = self.engine.places
        before, places.is_deep = places.is_deep, places.is_deep or self.history == DEEP
        if self.history != NO_HISTORY:
            places.kept.add(self)
        super().halt()
        places.is_deep = before

    def forget_places(self) -> None:
        """Forget the places of this node and those below it, since it has ended."""
        if self.history != NO_HISTORY:
            self.engine.places.forget(self.number, self.end)


WRITTEN, RANDOM = "written", "random"


@dataclass(frozen=True, slots=True)
class InTurn(Straight):
    """A list of nodes: the first that ends with the result `decides` ends the list with it."""

    nodes = children()
    reactive: bool = flag(
        "Whether earlier conditions (`check`, `wait_for`, lists of only those) are evaluated at each tick."
    )
    history: str = history()
    order: str = choice(
        WRITTEN, RANDOM, help="The order of the nodes: as `written`, or `random` (a new draw at each start)."
    )

    only_asks = True
    skipped = parts.Skipped.WITH_ALL_INSIDE
    decides: ClassVar[str]

    @property
    def in_order(self) -> str:
        """Return in which order, and what is special about it, in words."""
        order = "in random order" if self.order == RANDOM else "in order"
        more = [
            *(["looking at earlier conditions again and again"] if self.reactive else []),
            *(["beginning where it was cut short"] if self.history != NO_HISTORY else []),
        ]
        return ", ".join([order, *more])

    def may_end(self, node: MissionNode, endings: Endings) -> outcomes.Outcomes:
        """Return the deciding outcomes of every child, and all outcomes of the last one that is reached."""
        found, goes_on_never = (
            outcomes.NEVER,
            outcomes.ALWAYS_FAILS if self.decides == outcomes.FAILS else outcomes.ALWAYS_SUCCEEDS,
        )
        for child in map(endings.of, node.children[:-1]):
            found = found.both(child.of(self.decides))
            if child.plain in (outcomes.NEVER, goes_on_never):
                return found
        return found.both(endings.of(node.children[-1])) if node.children else found

    @property
    def comes_again(self) -> bool:
        """Return whether an earlier condition may make it go back."""
        return self.reactive


class InTurnTask(WithHistory):
    """Runs the nodes of a list in order; the first that ends with the result `decides` ends the list with it.

    If none does, the list ends like those that were not skipped.
    """

    __slots__ = ("all", "children", "conditions", "did", "index", "is_random", "order")
    saved = ("did", "index", "order")
    decides: ClassVar[int]

    def __init__(self, site: Site, step: InTurn) -> None:
        super().__init__(site)
        self.is_random = step.order == RANDOM
        self.history = step.history
        self.all = self.children = site.children
        self.order: list[int] = []  # of the children, if it was drawn
        self.conditions = _conditions(site) if step.reactive else {}
        self.index = 0
        self.did = SKIPPED

    def begin(self) -> int:
        """Start with the first child, or with the one where it was halted."""
        if self.engine.places.kept and self.engine.places.take_up(self):
            self.arrange()
            return self.proceed()
        self.index = 0
        self.did = SKIPPED
        if self.is_random:
            self.order = list(range(len(self.all)))
            self.engine.chance().shuffle(self.order)
            self.arrange()
        elif self.order:  # it was random when it last started
            self.order, self.children = [], self.all
        return self.proceed()

    def adapted(self, state: dict[str, Any], children: MovedChildren) -> dict[str, Any]:
        """Go on at the same child; new ones come last in an order that was drawn."""
        if not (order := state["order"]):
            return super().adapted(state, children)
        kept, at = children.kept(order), children.to(order[state["index"]])
        new = [index for index in range(children.count) if index not in kept]
        return {**state, "order": [*kept, *new], "index": kept.index(at) if at in kept else 0}

    def restored(self) -> None:
        """Put the children back in the order that was drawn."""
        self.arrange()

    def arrange(self) -> None:
        """Put the children in the order that was drawn."""
        if self.order:
            self.children = tuple(self.all[index] for index in self.order)

    def proceed(self) -> int:
        """Continue with the running child, then with the next ones as long as each ends immediately."""
        if self.conditions and self.index:
            self.ask_again()
        children, index, child, decides = self.children, self.index, self.current, self.decides
        while True:
            if child is None:
                child = children[index]
                status = child.start()
            else:
                status = child.tick()
            if status == RUNNING:
                self.index, self.current = index, child
                if self.conditions:
                    self.watch_conditions()
                return RUNNING
            child = None
            if status == decides:
                self.index, self.current = index, None
                return self.end_with(status)
            if status != SKIPPED:
                self.did = status
            index += 1
            if index == len(children):
                self.current = None
                return self.end_with(self.did)
            self.engine.outcome = ""

    def ask_again(self) -> None:
        """Evaluate the conditions before the running child again; go back to the first whose result differs.

        If an earlier result was forgotten meanwhile, it was one after which the list continued.
        """
        for index, child in enumerate(self.children[: self.index]):
            if child.number not in self.conditions:
                continue
            before = self.statuses[child.number]
            status = child.start()
            is_other = status in (RUNNING, self.decides) if before == IDLE else status != before
            if is_other:
                if status == RUNNING:
                    child.halt()
                if self.current is not None:
                    running, self.current = self.current, None
                    running.halt()
                self.index = index
                return

    def watch_conditions(self) -> None:
        """Wake when a condition before the running child may have changed."""
        for child in self.children[: self.index]:
            for watched in self.conditions.get(child.number, ()):
                self.engine.watch(watched)

    def end_with(self, status: int) -> int:
        """End, and forget the place; a sequence that failed keeps it."""
        if self.history != "none":
            self.forget_places()
            if status == FAILURE and self.is_kept_after_failure:
                self.engine.places.kept.add(self)
        return status


def _conditions(site: Site) -> dict[int, tuple[Watched, ...]]:
    """Return the children that only evaluate conditions, by number, with these conditions."""
    nodes = site.engine.program.nodes
    asking = (nodes[number] for number in site.node.children if _only_asks(nodes, nodes[number]))
    return {node.number: tuple(_asked(nodes[node.number : node.end])) for node in asking}


def _only_asks(nodes: tuple[MissionNode, ...], node: MissionNode) -> bool:
    return node.step.only_asks and all(_only_asks(nodes, nodes[child]) for child in node.children)


def _asked(nodes: tuple[MissionNode, ...]) -> list[Watched]:
    return [Watched.of(asked.expression) for node in nodes for asked in node.asked]


class Plain(Modifier):
    """A modifier that changes nothing about how its node may end, and never keeps it from starting."""

    __slots__ = ()
    may_skip = False
    serves = parts.ModifierScope.ALL

    def changed(self, inner: outcomes.Outcomes) -> outcomes.Outcomes:
        """Return the outcomes of the node inside."""
        return inner


@dataclass(frozen=True, slots=True)
class Acting(Plain):
    """A modifier whose keys are hooks."""

    moments: parts.Moments = field()

    value = None

    def clause(self) -> str:
        """Say each hook: 'on failure, log 'Missed it''."""
        return "; ".join(f"{spoken(key)}, {deeds_in_words(deeds)}" for key, deeds in self.moments.deeds.items())

    @classmethod
    def read(cls, reader: NodeReader) -> Self:
        """Read the hooks that are present."""
        return cls(reader.moments(cls.fields))


class Skipping(Modifier):
    """A modifier that may keep its node from starting: the node is then skipped, which is no failure."""

    __slots__ = ()
    may_skip = True

    def changed(self, inner: outcomes.Outcomes) -> outcomes.Outcomes:
        """Return that it may also be skipped."""
        return inner.both(outcomes.ALWAYS_SUCCEEDS)


class Decorator(Task):
    """A task around another task of the same node; it shares the fate of the inner one."""

    __slots__ = ("inner",)

    def __init__(self, site: Site, inner: Task) -> None:
        super().__init__(site)
        self.inner = inner

    def forget(self) -> None:
        """Leave this to the task inside, which may resume where it was halted."""

    def begin(self) -> int:
        """Start the task inside."""
        return self.proceed()

    def suspend(self, from_start: bool) -> bool:
        """Start again together with a leaf that starts again."""
        if self.current is not None and self.inner.suspend(from_start):
            self.current = None
            return True
        return False

    def proceed(self) -> int:
        """Continue with the task inside."""
        return self.advance(self.inner)
