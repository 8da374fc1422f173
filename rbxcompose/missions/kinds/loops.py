"""Loops.

`for`: a node for each item of a list.
`repeat`: the same node, a number of times or for ever.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from rbxcompose.base.expressions.check import StaticScope, check
from rbxcompose.base.expressions.tree import FieldAccess, Index, Variable
from rbxcompose.base.expressions.types import TEXT, common
from rbxcompose.base.expressions.values import NOT_ARRIVED, Located, is_located
from rbxcompose.missions import sdk
from rbxcompose.missions.engine.instant_actions import without
from rbxcompose.missions.engine.world import POSE, ItemScope
from rbxcompose.missions.program.program import NOTHING
from rbxcompose.missions.sdk import FAILURE, RUNNING, SKIPPED, SUCCESS  # looked up in every tick

WRITTEN, RANDOM, NEAREST = "written", "random", "nearest"
STOP, NEXT = "stop", "next"
ALL, ANY = "all", "any"
DONE, FAILED = "done", "failed"


class ForTask(sdk.Task):
    """Runs the body for one item after the other."""

    __slots__ = ("body", "did", "done", "failed", "left", "step", "taken", "view")
    saved = ("did", "done", "failed", "left", "taken")

    def __init__(self, site: sdk.Site, step: ForStep) -> None:
        super().__init__(site)
        if site.item is None:
            raise TypeError(f"the loop '{site.node.path}' has no item")
        self.body = site.children[0]
        self.view: ItemScope = site.item
        self.step = step
        self.left: list[sdk.Value] = []  # items that have not been taken yet
        self.taken: sdk.Value = None  # the current item
        self.done: list[sdk.Value] = []
        self.failed: list[sdk.Value] = []
        self.did = sdk.SKIPPED

    def begin(self) -> int:
        """Read the list and begin with its first item, or with the one at which it was halted."""
        if self.engine.places.kept and self.engine.places.take_up(self):
            self.view.item = self.taken
            return self.proceed()
        self.left, self.done, self.failed = self._read_items(), [], []
        self.did = sdk.SKIPPED
        if not self.left:
            return sdk.SKIPPED
        if self.step.order == RANDOM:
            self.engine.chance().shuffle(self.left)
        self._take()
        return self.proceed()

    def proceed(self) -> int:
        """Continue with this item; the next one starts in another tick."""
        status = self.advance(self.body)
        if status == sdk.RUNNING:
            return sdk.RUNNING
        self.engine.outcome = ""
        if self._decides(status):
            return status
        if not self.left:
            return self.did
        self._take()
        self.engine.again(self)
        return sdk.RUNNING

    def restart(self, target: sdk.Target) -> bool:
        """Restart the current round of this loop, if that is the target."""
        if self.number == target.number and target.is_round:
            if self.current is not None:
                body, self.current = self.current, None
                body.halt()
            return True
        return super().restart(target)

    def restored(self) -> None:
        """Make the item visible to the body."""
        self.view.item = self.taken

    def result(self) -> sdk.Value:
        """Return the items that succeeded and those that failed."""
        return {DONE: list(self.done), FAILED: list(self.failed)}

    def _decides(self, status: int) -> bool:
        """Record the result of an item, and return whether it decides the result of the loop."""
        if status == sdk.FAILURE:
            self.failed.append(self.taken)
            self.did = sdk.FAILURE
            return self.step.if_one_fails == STOP and self.step.succeed_when == ALL
        if status == sdk.SUCCESS:
            self.done.append(self.taken)
            if self.did == sdk.SKIPPED:
                self.did = sdk.SUCCESS
            if self.step.remove_done and isinstance(self.step.items, sdk.Expression):
                without(self.step.items.tree, self.taken, self.run.data, self.scope)
            return self.step.succeed_when == ANY
        return False

    def _take(self) -> None:
        self.taken = self.left.pop(self._nearest() if self.step.order == NEAREST else 0)
        self.view.item = self.taken
        self.engine.places.forget(self.number + 1, self.end)
        self.forget()

    def _nearest(self) -> int:
        """Return the index of the item that is nearest to the robot, in a straight line."""
        pose = self.scope.variable(POSE)
        if pose is NOT_ARRIVED:
            raise sdk.NotArrivedError(POSE)
        if not is_located(pose):
            raise sdk.NodeFailed("'order: nearest' needs to know where the robot is")
        ways = [math.hypot(place.x - pose.x, place.y - pose.y) for place in map(self._place, self.left)]
        return ways.index(min(ways))

    def _place(self, item: sdk.Value) -> Located:
        found = self.engine.robot.places.get(item) if isinstance(item, str) else item
        if not is_located(found):
            raise sdk.NodeFailed(f"'order: nearest' needs places, not {self.run.show('', item)}")
        return found

    def _read_items(self) -> list[sdk.Value]:
        items = self.step.items
        if isinstance(items, tuple):
            return [sdk.evaluate(item, self.scope) for item in items]
        value = sdk.evaluate(items, self.scope)
        if not isinstance(value, list | tuple | Mapping):
            raise sdk.NodeFailed(f"'in' must be a list or a map, not {self.run.show('', value)}")
        return list(value)


@sdk.kind("for", ForTask)
@sdk.dataclass(frozen=True, slots=True)
class ForStep(sdk.Loop):
    """Do the body for each item of a list; the body reads the item by its `$name`.

    Example:
        do:
          for: corner
          in: [corner_1, corner_2]
          if_one_fails: next
          do:
            go_to: $corner
    """

    item: str = sdk.item_name()
    items: sdk.Expression | tuple[sdk.Expression, ...] = sdk.items(
        "A list, or a map, whose keys it takes; it is read once, at the start.", "in"
    )
    do = sdk.child("What is done for each item.")
    if_one_fails: str = sdk.choice(
        STOP, NEXT, help="`stop` fails at once; `next` does the other items and fails at the end."
    )
    order: str = sdk.choice(
        *(WRITTEN, RANDOM, NEAREST),
        help="The order: as `written`, `random` (a new draw at each start), or the `nearest` place first.",
    )
    succeed_when: str = sdk.choice(
        *(ALL, ANY), help="`all` must succeed, or `any`: it continues after a failure and ends at the first success."
    )
    remove_done: bool = sdk.flag("Whether an item that succeeded is removed from the data that `in` names.")

    has_result = True
    result_names = (DONE, FAILED)
    flow = sdk.NodeFlow.PER_ITEM
    look = sdk.NodeLook("↻")

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say the items, their order, and what a failure means."""
        items = ", ".join(map(sdk.spoken, self.items)) if isinstance(self.items, tuple) else sdk.spoken(self.items)
        order = {NEAREST: ", the nearest first", RANDOM: ", in random order"}.get(self.order, "")
        fails = ", also after a failure" if self.if_one_fails == NEXT else ""
        ends = ", until one succeeds" if self.succeed_when == ANY else ""
        removed = ", removing it when done" if self.remove_done else ""
        return f"For each {sdk.spoken(self.item)} of {items}{order}{fails}{ends}{removed}"

    def shows(self, node: sdk.MissionNode, scope: StaticScope) -> Mapping[str, sdk.Type]:
        """Return the item's name, with the type that all items have."""
        if not node.item:
            return {}
        if isinstance(self.items, tuple):
            return {node.item: common(check(item, scope)[0] for item in self.items)}
        found, _ = check(self.items, scope)
        return {node.item: TEXT if found.kind is sdk.TypeKind.MAP else found.entry}

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return that it fails if its body fails or its list cannot be read."""
        if self.order == NEAREST or self.remove_done or not node.children or not self._is_read(endings):
            return sdk.ANY
        return sdk.Outcomes(fails=endings.of(node.children[0]).plain.fails)

    def _is_read(self, endings: sdk.Endings) -> bool:
        """Return whether its list can always be read."""
        if isinstance(self.items, tuple):
            return not any(item.names for item in self.items)
        written = self.items.tree.name if isinstance(self.items.tree, Variable) else ""
        return isinstance(endings.constants.get(written), list | tuple | Mapping)

    def endless(self, ends: sdk.Outcomes) -> None:
        """Return no advice: every list has an end."""

    def text(self, node: sdk.MissionNode) -> str:
        """Return the item's name and the list."""
        items = ", ".join(asked.scalar.text for asked in node.asked[: node.own])
        return f"{node.item} in {items}" if items else node.item

    @property
    def reads(self) -> frozenset[str]:
        """Return the robot's pose, if the nearest item comes first."""
        return frozenset({POSE}) if self.order == NEAREST else NOTHING

    @property
    def effects(self) -> sdk.NodeEffects:
        """Return the data that holds its items, if it removes those that are done."""
        if not self.remove_done:
            return sdk.NO_EFFECTS
        tree = None if isinstance(self.items, tuple) else self.items.tree
        while isinstance(tree, FieldAccess | Index):
            tree = tree.of
        return sdk.NodeEffects(shortened=tree.name if isinstance(tree, Variable) else "")


class RepeatTask(sdk.Task):
    """Runs one round after the other."""

    __slots__ = ("body", "did", "due", "is_between", "left", "period", "step")
    saved = ("did", "due", "is_between", "left", "period")
    times = ("due",)
    fresh = ("due", "period")

    def __init__(self, site: sdk.Site, step: RepeatStep) -> None:
        super().__init__(site)
        self.body = site.children[0]
        self.step = step
        self.left = math.inf
        self.period = 0.0
        self.due = 0.0  # when the next round may start [s]
        self.is_between = False  # one round has ended and the next one has not started
        self.did = SKIPPED

    def begin(self) -> int:
        """Start the first round, or the one in which it was halted."""
        if self.engine.places.kept and self.engine.places.take_up(self):
            self.due = self.engine.time if self.is_between else self.engine.time + self.period
            return self.proceed()
        rounds, every = self.step.rounds, self.step.every
        self.left = math.inf if rounds is None else self.count_of(rounds, "'repeat'")
        self.period = 0.0 if every is None else self.number_of(every, "'every'")
        if self.left < 1:
            return SKIPPED
        self.did = SKIPPED
        self.is_between = True
        self.due = self.engine.time
        return self.proceed()

    def proceed(self) -> int:
        """Continue with this round; the next one starts in another tick."""
        if self.is_between:
            if not self.engine.is_due(self.due):
                return RUNNING
            self.is_between = False
            self.due = self.engine.time + self.period
        status = self.advance(self.body)
        if status == RUNNING:
            return RUNNING
        self.engine.outcome = ""
        if status == FAILURE:
            return FAILURE
        if status == SUCCESS:
            self.did = SUCCESS
        self.left -= 1
        until = self.step.until
        if self.left < 1 or (until is not None and sdk.holds(until, self.scope)):
            return self.did
        self.is_between = True
        if self.engine.is_due(self.due):
            self.engine.again(self)
        return RUNNING


@sdk.kind("repeat", RepeatTask)
@sdk.dataclass(frozen=True, slots=True)
class RepeatStep(sdk.Loop):
    """Do the body repeatedly. It fails with the first round that fails, and succeeds after the last.

    Example:
        do:
          repeat: 3
          every: 1 min
          until: $battery < 40 %
          do:
            go_to: corner_1
    """

    rounds: sdk.Expression | None = sdk.count_or_forever(least=1)
    do = sdk.child("What is done in each round.")
    until: sdk.Expression | None = sdk.watched(
        "A condition that ends the loop; it is evaluated after each round and never cuts one short.", optional=True
    )
    every: sdk.Expression | None = sdk.duration(
        "Time from the start of one round to the start of the next.", optional=True, least=0
    )

    flow = sdk.NodeFlow.IN_TURN
    look = sdk.NodeLook("↻")

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say how often, how fast, and what ends it."""
        often = "for ever" if self.rounds is None else sdk.times_in_words(self.rounds)
        every = f", every {sdk.spoken(self.every)}" if self.every else ""
        until = f", until {sdk.condition_in_words(self.until)}" if self.until else ""
        return f"Repeat {often}{every}{until}"

    @property
    def lasts(self) -> sdk.Expression | None:
        """Return `every`."""
        return self.every

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return the outcomes; an endless loop can only fail."""
        body = endings.of(node.children[0]).plain if node.children else sdk.ANY
        if self.rounds is None and self.until is None:
            return sdk.Outcomes(succeeds=False, fails=body.fails)
        return sdk.Outcomes(fails=body.fails) if self._is_counted(node) else sdk.ANY

    def _is_counted(self, node: sdk.MissionNode) -> bool:
        """Return whether the number of rounds and their period are literals, and `until` can always be evaluated."""
        if not any(asked.expression.names for asked in node.asked):
            return True
        return sdk.is_simple(node) and all(
            expression is None or isinstance(expression.tree, sdk.Number) for expression in (self.rounds, self.every)
        )

    def endless(self, ends: sdk.Outcomes) -> sdk.Advice | None:
        """Return advice on an endless loop."""
        advice = sdk.Advice("this loop never waits", "give it 'every: 1 s', or a 'wait' in its body")
        return advice if self.rounds is None else None

    @property
    def waits(self) -> bool:
        """Return whether it waits between its rounds, which takes a period."""
        return sdk.takes_time(self.every)
