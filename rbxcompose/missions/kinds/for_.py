"""`for`: the same with each item of a list."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rbxcompose.expressions.check import check
from rbxcompose.expressions.evaluate import evaluate
from rbxcompose.expressions.tree import Expression
from rbxcompose.expressions.types import TEXT, UNKNOWN, Type, TypeKind
from rbxcompose.expressions.values import Value
from rbxcompose.findings import Finding
from rbxcompose.missions import codes
from rbxcompose.missions.registry import kind
from rbxcompose.missions.scopes import ItemScope
from rbxcompose.missions.statuses import FAILURE, RUNNING, SKIPPED, SUCCESS
from rbxcompose.missions.task import NodeFailed, Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader
    from rbxcompose.missions.views import View

LISTED = (TypeKind.LIST, TypeKind.MAP, TypeKind.UNKNOWN)


@dataclass(frozen=True, slots=True)
class ForOptions:
    """The items, as one expression or one per item; whether a failed item leaves the others to be done."""

    items: Expression | tuple[Expression, ...]
    goes_on: bool


@kind(
    "for",
    {
        "in": "The items: a list, or a map, whose keys they are; read once, at the start.",
        "do": "What is done with each item.",
        "order": "In which order.",
        "if_one_fails": "Whether the loop ends there and fails, or does the rest and fails at the end.",
    },
)
class For(Task):
    """Do the body with each item in turn; the list is read once, at the start.

    Example:
        do:
          for: corner
          in: [corner_1, corner_3]
          if_one_fails: next
          do:
            go_to: $corner
    """

    __slots__ = ("body", "did", "index", "items", "options", "view")

    def __init__(self, site: Site, options: ForOptions) -> None:
        super().__init__(site)
        if site.item is None:
            raise TypeError(f"the loop '{site.node.path}' has no item")
        self.body = site.children[0]
        self.view: ItemScope = site.item
        self.options = options
        self.items: list[Value] = []
        self.index = -1  # of the item that is being done
        self.did = SKIPPED

    @staticmethod
    def read(reader: NodeReader) -> ForOptions:
        """Read the item's name, `in`, `do`, `order` and `if_one_fails`."""
        reader.item_name()
        items = reader.items("in")
        reader.child("do")
        reader.choice("order", ("written",))
        return ForOptions(items, reader.choice("if_one_fails", ("stop", "next")) == "next")

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

    @staticmethod
    def check(view: View) -> Iterator[Finding]:
        """What it goes through must be a list or a map."""
        options = view.node.options
        if isinstance(options, ForOptions) and not isinstance(options.items, tuple):
            found, _ = check(options.items, view.scope)
            if found.kind not in LISTED and view.node.asked:
                yield codes.WRONG_TYPE.at(
                    view.node.asked[0].scalar.span, f"'in' must be a list or a map; it is {found.phrase}"
                )

    def begin(self) -> int:
        """Read the list and begin with its first item."""
        self.items = self._read_items()
        if not self.items:
            return SKIPPED
        self.did = SKIPPED
        self._take(0)
        return self.proceed()

    def proceed(self) -> int:
        """Go on with this item; the next one is for another tick."""
        status = self.advance(self.body)
        if status == RUNNING:
            return RUNNING
        if status == FAILURE:
            if not self.options.goes_on:
                return FAILURE
            self.did = FAILURE
        elif status == SUCCESS and self.did == SKIPPED:
            self.did = SUCCESS
        if self.index + 1 == len(self.items):
            return self.did
        self._take(self.index + 1)
        self.engine.again(self)
        return RUNNING

    def _take(self, index: int) -> None:
        self.index = index
        self.view.item = self.items[index]
        self.forget()

    def _read_items(self) -> list[Value]:
        items = self.options.items
        if isinstance(items, tuple):
            return [evaluate(item, self.scope) for item in items]
        value = evaluate(items, self.scope)
        if not isinstance(value, list | tuple | Mapping):
            raise NodeFailed(f"'in' must be a list or a map, not {self.engine.show('', value)}")
        return list(value)
