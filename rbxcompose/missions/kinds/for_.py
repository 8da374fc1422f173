"""`for`: a node for each item of a list."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rbxcompose.expressions.check import check
from rbxcompose.expressions.evaluate import evaluate
from rbxcompose.expressions.tree import Expression
from rbxcompose.expressions.types import TEXT, UNKNOWN, Type, TypeKind
from rbxcompose.expressions.values import NOT_ARRIVED, Located, NotArrivedError, Value
from rbxcompose.missions.editing import without
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import FAILURE, RUNNING, SKIPPED, SUCCESS
from rbxcompose.missions.task import NodeFailed, Site, Task
from rbxcompose.missions.watching import POSE

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader
    from rbxcompose.missions.program import Target
    from rbxcompose.missions.scopes import ItemScope
    from rbxcompose.missions.views import View

LISTED = (TypeKind.LIST, TypeKind.MAP, TypeKind.UNKNOWN)
WRITTEN, RANDOM, NEAREST = "written", "random", "nearest"
STOP, NEXT = "stop", "next"
ALL, ANY = "all", "any"


@dataclass(frozen=True, slots=True)
class ForOptions:
    """What the loop goes through, in which order, and what results of its items mean."""

    items: Expression | tuple[Expression, ...]
    goes_on: bool = False
    order: str = WRITTEN
    ends_at_success: bool = False
    removes_done: bool = False

    @property
    def names(self) -> frozenset[str]:
        """Return the names that it reads beside its expressions."""
        return frozenset({POSE}) if self.order == NEAREST else frozenset()


@kind(
    "for",
    {
        "in": "What it goes through: a list, or a map, of which it takes the keys; it is read once, at the start.",
        "do": "What is done for each item.",
        "order": "In which order: as `written`, `random` (drawn anew at each start), or the `nearest` place first.",
        "if_one_fails": "`stop` fails at once; `next` does the rest and fails at the end.",
        "succeed_when": "`all` must succeed, or `any`: it goes on after a failure and ends at the first success.",
        "remove_done": "Whether an item that has succeeded leaves the data that `in` names.",
    },
)
class For(Task):
    """Do the body for each item, which the body sees as `$item`.

    Example:
        do:
          for: corner
          in: [corner_1, corner_2]
          if_one_fails: next
          do:
            go_to: $corner
    """

    __slots__ = ("body", "did", "done", "failed", "left", "options", "taken", "view")
    saved = ("did", "done", "failed", "left", "taken")

    def __init__(self, site: Site, options: ForOptions) -> None:
        super().__init__(site)
        if site.item is None:
            raise TypeError(f"the loop '{site.node.path}' has no item")
        self.body = site.children[0]
        self.view: ItemScope = site.item
        self.options = options
        self.left: list[Value] = []  # items that have not been taken
        self.taken: Value = None  # the item that is being done
        self.done: list[Value] = []
        self.failed: list[Value] = []
        self.did = SKIPPED

    @staticmethod
    def read(reader: NodeReader) -> ForOptions:
        """Read the item's name, `in`, `do` and what results mean."""
        reader.item_name()
        items = reader.items("in")
        reader.child("do")
        return ForOptions(
            items,
            reader.choice("if_one_fails", (STOP, NEXT)) == NEXT,
            reader.choice("order", (WRITTEN, RANDOM, NEAREST)),
            reader.choice("succeed_when", (ALL, ANY)) == ANY,
            reader.flag("remove_done") if reader.has("remove_done") else False,
        )

    @staticmethod
    def item_type(view: View) -> Type:
        """Return the type that all items have."""
        options = view.node.options
        if not isinstance(options, ForOptions):
            return UNKNOWN
        if isinstance(options.items, tuple):
            types = {check(item, view.scope)[0] for item in options.items}
            return types.pop() if len(types) == 1 else UNKNOWN
        found, _ = check(options.items, view.scope)
        return TEXT if found.kind is TypeKind.MAP else found.entry

    def begin(self) -> int:
        """Read the list and begin with its first item, or with the one in which it was halted."""
        if self.engine.places.kept and self.engine.places.take_up(self):
            self.view.item = self.taken
            return self.proceed()
        self.left, self.done, self.failed = self._read_items(), [], []
        self.did = SKIPPED
        if not self.left:
            return SKIPPED
        if self.options.order == RANDOM:
            self.engine.chance().shuffle(self.left)
        self._take()
        return self.proceed()

    def proceed(self) -> int:
        """Go on with this item; the next one is for another tick."""
        status = self.advance(self.body)
        if status == RUNNING:
            return RUNNING
        self.engine.outcome = ""
        if self._decides(status):
            return status
        if not self.left:
            return self.did
        self._take()
        self.engine.again(self)
        return RUNNING

    def restart(self, target: Target) -> bool:
        """Let the round of this loop begin again, if that is what is named."""
        if self.number == target.number and target.is_round:
            if self.current is not None:
                body, self.current = self.current, None
                body.halt()
            return True
        return super().restart(target)

    def restored(self) -> None:
        """Show the item to the body."""
        self.view.item = self.taken

    def result(self) -> Value:
        """Return the items that succeeded and those that failed."""
        return {"done": list(self.done), "failed": list(self.failed)}

    def _decides(self, status: int) -> bool:
        """Note the result of an item, and tell whether it is that of the loop."""
        if status == FAILURE:
            self.failed.append(self.taken)
            self.did = FAILURE
            return not self.options.goes_on and not self.options.ends_at_success
        if status == SUCCESS:
            self.done.append(self.taken)
            if self.did == SKIPPED:
                self.did = SUCCESS
            if self.options.removes_done and isinstance(self.options.items, Expression):
                without(self.options.items.tree, self.taken, self.run.data, self.scope)
            return self.options.ends_at_success
        return False

    def _take(self) -> None:
        self.taken = self.left.pop(self._nearest() if self.options.order == NEAREST else 0)
        self.view.item = self.taken
        self.engine.places.forget(self.number + 1, self.end)
        self.forget()

    def _nearest(self) -> int:
        """Return the index of the item that is nearest to the robot, in a straight line."""
        pose = self.scope.variable(POSE)
        if pose is NOT_ARRIVED:
            raise NotArrivedError(POSE)
        if not isinstance(pose, Located):
            raise NodeFailed("'order: nearest' needs to know where the robot is")
        ways = [math.hypot(place.x - pose.x, place.y - pose.y) for place in map(self._place, self.left)]
        return ways.index(min(ways))

    def _place(self, item: Value) -> Located:
        found = self.engine.robot.places.get(item) if isinstance(item, str) else item
        if not isinstance(found, Located):
            raise NodeFailed(f"'order: nearest' needs places, not {self.run.show('', item)}")
        return found

    def _read_items(self) -> list[Value]:
        items = self.options.items
        if isinstance(items, tuple):
            return [evaluate(item, self.scope) for item in items]
        value = evaluate(items, self.scope)
        if not isinstance(value, list | tuple | Mapping):
            raise NodeFailed(f"'in' must be a list or a map, not {self.run.show('', value)}")
        return list(value)
