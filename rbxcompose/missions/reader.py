"""What a kind of node, or a modifier, may ask of who reads it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable

from rbxcompose.expressions.tree import Expression
from rbxcompose.manifest.tree import Entry, Mapping, Node
from rbxcompose.missions.asked import Argument, Asked, Assignment
from rbxcompose.missions.messages import Message
from rbxcompose.missions.moments import Moments
from rbxcompose.missions.value_reader import ValueReader


class Reader(ValueReader, ABC):
    """One mapping of a mission, being read: single values, and the nodes below."""

    @abstractmethod
    def map_of(self, key: str, what: str) -> Mapping | None:
        """Return an option that must be a map with entries; None, and a finding, if it is not."""

    @abstractmethod
    def inside(self, mapping: Mapping, keys: Iterable[str], what: str) -> Reader:
        """Return a reader of a map below this node; keys that do not belong to it are findings."""

    @abstractmethod
    def child(self, key: str) -> None:
        """Read the node under a key, which must be there."""

    @abstractmethod
    def child_node(self, node: Node, step: str) -> None:
        """Read a node that belongs to this one."""

    @abstractmethod
    def steps(self) -> None:
        """Read the list that is the kind's value."""

    @abstractmethod
    def branches(self) -> tuple[str, ...]:
        """Read nodes for the same time: a list, or a map, of which the names are returned."""

    @abstractmethod
    def cases(self, key: str) -> tuple[Asked, ...]:
        """Read a map from values to nodes, and return the values in the order of the children."""

    @abstractmethod
    def state(self, name: str, entry: Entry) -> None:
        """Read a state of a machine."""

    @abstractmethod
    def held(self, expression: Expression) -> None:
        """Read the nodes in the data that an expression may give."""

    @abstractmethod
    def item_name(self) -> None:
        """Read the name that the nodes below give to a loop's item."""

    @abstractmethod
    def items(self, key: str) -> Expression | tuple[Expression, ...]:
        """Read a list that is written out, or an expression that gives one (of a map: its keys)."""

    @abstractmethod
    def asked_later(self, mapping: Mapping, key: str) -> Asked | None:
        """Read a condition whose names only its kind knows, so that the kind has to check it."""

    @abstractmethod
    def message(self, target: str, body: str) -> Message:
        """Read where a message goes, and what is in it."""

    @abstractmethod
    def moments(self, keys: Iterable[str]) -> Moments:
        """Read hooks: what is set, logged or published at some moments."""

    @abstractmethod
    def assignments(self, key: str) -> tuple[Assignment, ...]:
        """Read a map from names of data to expressions."""

    @abstractmethod
    def arguments(self) -> tuple[Argument, ...]:
        """Read the arguments of a skill: one value, or a map of several."""
