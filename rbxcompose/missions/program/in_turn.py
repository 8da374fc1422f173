"""What kinds share that run nodes one after the other and resume where they were halted."""

from typing import Any, ClassVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.missions.engine.resume_points import DEEP, NO_HISTORY
from rbxcompose.missions.engine.task import MovedChildren, Site, Task
from rbxcompose.missions.engine.world import Watched
from rbxcompose.missions.language.fields import children, choice, flag, history
from rbxcompose.missions.program import outcomes
from rbxcompose.missions.program.answers import Skipped
from rbxcompose.missions.program.families import Straight
from rbxcompose.missions.program.outcomes import FAILURE, IDLE, RUNNING, SKIPPED  # looked up in every tick
from rbxcompose.missions.program.program import Endings, MissionNode


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
    skipped = Skipped.WITH_ALL_INSIDE
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
