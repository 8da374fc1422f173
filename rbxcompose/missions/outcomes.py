"""How a node may end, as far as the text tells: what machines must have transitions for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from rbxcompose.expressions.tree import Arithmetic, Field, Index, Number, Variable, walk
from rbxcompose.missions.calling import UseOptions
from rbxcompose.missions.facts import constants_of, is_simple, never_fails
from rbxcompose.missions.kinds.for_ import NEAREST, ForOptions
from rbxcompose.missions.kinds.parallel import ParallelOptions
from rbxcompose.missions.kinds.repeat import RepeatOptions
from rbxcompose.missions.machines import ENDS, MachineOptions, StateOptions
from rbxcompose.missions.modifiers.limits import Tries
from rbxcompose.missions.modifiers.registry import modifiers
from rbxcompose.missions.program import Node, Program, RobotNames
from rbxcompose.missions.statuses import FAILURE, NAMES, SUCCESS

SUCCEEDS, FAILS = NAMES[SUCCESS], NAMES[FAILURE]


@dataclass(frozen=True, slots=True)
class Outcomes:
    """Whether a node may end in success or in failure, and its outcomes of its own with what each counts as.

    A node that can do neither never ends by itself. Where not all is known, everything is possible.
    """

    succeeds: bool = True
    fails: bool = True
    named: Mapping[str, str] = field(default_factory=dict)

    @property
    def words(self) -> Mapping[str, str]:
        """Return all outcomes with what each counts as."""
        plain = {word: word for word, can in ((SUCCEEDS, self.succeeds), (FAILS, self.fails)) if can}
        return {**plain, **self.named}

    def both(self, other: Outcomes) -> Outcomes:
        """Return what either may do."""
        return Outcomes(self.succeeds or other.succeeds, self.fails or other.fails, {**self.named, **other.named})

    def of(self, word: str) -> Outcomes:
        """Return only those that count as success, or as failure."""
        named = {name: counts for name, counts in self.named.items() if counts == word}
        return Outcomes(self.succeeds and word == SUCCEEDS, self.fails and word == FAILS, named)

    def counting_as(self, word: str) -> bool:
        """Tell whether any of them counts as success, or as failure."""
        return word in self.words.values()

    @property
    def plain(self) -> Outcomes:
        """Return them without their names."""
        return Outcomes(self.counting_as(SUCCEEDS), self.counting_as(FAILS))


NAMELESS = {SUCCEEDS: SUCCEEDS, FAILS: FAILS}
NEVER = Outcomes(succeeds=False, fails=False)
ALWAYS_SUCCEEDS = Outcomes(fails=False)
ANY = Outcomes()


class Ending:
    """Finds how the nodes of a mission may end."""

    def __init__(self, program: Program, robot: RobotNames, within: tuple[str, ...] = ()) -> None:
        self.program = program
        self.robot = robot
        self.within = within  # missions that are being looked at
        self._known: dict[int, Outcomes] = {}

    def of(self, number: int) -> Outcomes:
        """Return how a node may end, its modifiers included."""
        if number not in self._known:
            node = self.program.nodes[number]
            self._known[number] = _modified(node, self._inside(node))
        return self._known[number]

    def inside_of(self, node: Node, key: str) -> Outcomes:
        """Return how that may end which is inside of a modifier of a node: what the modifier works on."""
        order = list(modifiers())
        inner = {name: one for name, one in node.modifiers.items() if order.index(name) > order.index(key)}
        return _modified(replace(node, modifiers=inner), self._inside(node))

    def mission(self) -> Outcomes:
        """Return how the mission may end."""
        found = self.of(self.program.main)
        for interrupt in self.program.interrupts:
            reaction = ALWAYS_SUCCEEDS if interrupt.root is None else self.of(interrupt.root)
            found = found.both(Outcomes(interrupt.afterwards == "end", reaction.counting_as(FAILS)))
        ends = [node.options for node in self.program.nodes if node.kind == "end"]
        for options in ends:
            result = getattr(options, "result", FAILS)
            found = found.both(Outcomes(result == SUCCEEDS, result == FAILS))
        return found

    def of_branches(self, node: Node) -> dict[str, Outcomes]:
        """Return how each branch of a parallel may end, by its name."""
        names = node.options.branches if isinstance(node.options, ParallelOptions) else ()
        return {name: self.of(child) for name, child in zip(names, node.children, strict=False)}

    def _inside(self, node: Node) -> Outcomes:
        if node.skill:
            skill = self.robot.skills.get(node.skill)
            return Outcomes(named=skill.outcomes) if skill else ANY
        rule = _RULES.get(node.kind)
        if rule:
            return rule(self, node)
        return ALWAYS_SUCCEEDS if never_fails(node) or self._is_sure(node) else ANY

    def _is_sure(self, node: Node) -> bool:
        """Tell whether a `set` or `log` reads only what is there from the start, in ways that cannot go wrong."""
        if node.kind not in ("set", "log"):
            return False
        own = {*self.program.inputs, *self.program.data, *(one.item for one in self.program.nodes if one.item)}
        if any(name.name not in own for asked in node.asked for name in asked.expression.names):
            return False
        parts = (part for asked in node.asked for part, _ in walk(asked.expression.tree))
        return not any(isinstance(part, Index | Field) or _divides(part) for part in parts)

    def _children(self, node: Node) -> list[Outcomes]:
        return [self.of(child) for child in node.children]

    def sequence(self, node: Node) -> Outcomes:
        """Any child's failure, the last one's success."""
        return self._list(node, FAILS)

    def fallback(self, node: Node) -> Outcomes:
        """Any child's success, the last one's failure."""
        return self._list(node, SUCCEEDS)

    def _list(self, node: Node, decides: str) -> Outcomes:
        found = NEVER
        children = self._children(node)
        for index, child in enumerate(children):
            is_last = index + 1 == len(children)
            found = found.both(child if is_last else child.of(decides))
            if not child.plain.succeeds and not child.plain.fails:
                return found  # it never ends
            if not is_last and child.plain == (
                Outcomes(fails=True, succeeds=False) if decides == FAILS else ALWAYS_SUCCEEDS
            ):
                return found
        return found

    def branches(self, node: Node) -> Outcomes:
        """One of some nodes, or none of them."""
        found = ALWAYS_SUCCEEDS
        for child in self._children(node):
            found = found.both(child)
        is_sure = not node.asked or (node.kind == "if" and is_simple(node))
        return found if is_sure else found.both(Outcomes(succeeds=False))

    def loop(self, node: Node) -> Outcomes:
        """A loop fails with its body, and may fail to read its list."""
        options = node.options
        if not isinstance(options, ForOptions) or options.order == NEAREST or options.removes_done or not node.children:
            return ANY
        items = options.items
        if isinstance(items, tuple):
            is_read = not any(item.names for item in items)
        else:
            written = items.tree.name if isinstance(items.tree, Variable) else ""
            is_read = isinstance(constants_of(self.program, {}).get(written), list | tuple | Mapping)
        return Outcomes(fails=self.of(node.children[0]).plain.fails) if is_read else ANY

    def repeat(self, node: Node) -> Outcomes:
        """A loop for ever ends with a failure only."""
        body = self.of(node.children[0]).plain if node.children else ANY
        options = node.options
        if isinstance(options, RepeatOptions) and options.rounds is None and options.until is None:
            return Outcomes(succeeds=False, fails=body.fails)
        return Outcomes(fails=body.fails) if self._is_counted(node) else ANY

    @staticmethod
    def _is_counted(node: Node) -> bool:
        """Tell whether the number of rounds and the time of one are written out, and `until` can always be asked."""
        if not any(asked.expression.names for asked in node.asked):
            return True
        options = node.options
        numbers = (options.rounds, options.every) if isinstance(options, RepeatOptions) else ()
        return is_simple(node) and all(one is None or isinstance(one.tree, Number) for one in numbers)

    def parallel(self, node: Node) -> Outcomes:
        """Outcomes by conditions, else those of the branch it ends with, else the plain ones."""
        options = node.options
        if not isinstance(options, ParallelOptions):
            return ANY
        if options.outcomes:
            return Outcomes(False, False, {one.name: NAMELESS.get(one.name, "") for one in options.outcomes})
        if options.ends_with in options.branches:
            return self.of(node.children[options.branches.index(options.ends_with)])
        children = [child.plain for child in self._children(node)]
        return Outcomes(any(child.succeeds for child in children), any(child.fails for child in children))

    def machine(self, node: Node) -> Outcomes:
        """The ends that its states lead to."""
        options = node.options
        if not isinstance(options, MachineOptions):
            return ANY
        leads = [self.program.nodes[child].options for child in node.children]
        reached = {to for one in leads if isinstance(one, StateOptions) and one.next for to in one.next.to.values()}
        named = {end: counts for end, counts in options.ends.items() if end in reached and end not in ENDS}
        return Outcomes("finished" in reached, "failed" in reached, named)

    def state(self, node: Node) -> Outcomes:
        """Its body."""
        return self.of(node.children[0]) if node.children else ANY

    def use(self, node: Node) -> Outcomes:
        """The mission."""
        options = node.options
        name = options.mission if isinstance(options, UseOptions) else ""
        program = self.robot.missions.get(name)
        if program is None or name in self.within:
            return ANY
        return Ending(program, self.robot, (*self.within, name)).mission()

    def held(self, node: Node) -> Outcomes:
        """Any of the nodes in the data."""
        found = Outcomes(succeeds=not node.children)
        for child in self._children(node):
            found = found.both(child)
        return found


def _divides(part: object) -> bool:
    return isinstance(part, Arithmetic) and part.operator == "/"


def _modified(node: Node, inner: Outcomes) -> Outcomes:
    """Return how a node with its modifiers may end."""
    found, modifiers = inner, node.modifiers
    tries = modifiers.get("attempts")
    if isinstance(tries, Tries) and tries.most is None and not tries.timeout:
        found = found.of(SUCCEEDS)
    if "timeout" in modifiers or "as_long_as" in modifiers:
        found = found.both(Outcomes(succeeds=False))
    if modifiers.get("invert") is True:
        found = Outcomes(found.counting_as(FAILS), found.counting_as(SUCCEEDS))
    if modifiers.get("optional") is True and found.counting_as(FAILS):
        found = found.of(SUCCEEDS).both(ALWAYS_SUCCEEDS)
    if any(key in modifiers for key in ("only_if", "skip_if", "once", "cooldown")):
        found = found.both(ALWAYS_SUCCEEDS)
    return found


_RULES: Mapping[str, Callable[[Ending, Node], Outcomes]] = {
    "sequence": Ending.sequence,
    "fallback": Ending.fallback,
    "if": Ending.branches,
    "choose": Ending.branches,
    "for": Ending.loop,
    "repeat": Ending.repeat,
    "parallel": Ending.parallel,
    "machine": Ending.machine,
    "state": Ending.state,
    "use": Ending.use,
    "run": Ending.held,
    "end": lambda self, node: NEVER,
}
