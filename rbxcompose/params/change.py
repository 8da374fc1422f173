"""A change of live settings: what is wanted of which components, by whom, and why it is not done."""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections.abc import Mapping
from typing import Protocol, Self

from rbxcompose.config import Config
from rbxcompose.dataclass import dataclass
from rbxcompose.msgs.cdr import decode, encode
from rbxcompose.msgs.rbxcompose_parameters import NodeChange

Configs = Mapping[str, Config]  # by component


@dataclass(frozen=True, slots=True)
class ChangeRefusal:
    """Why a change is not done, and what to do instead.

    `breaks_rule` tells that a rule about the whole robot forbids it, `is_half_done` that a component did not take its
    old values back.
    """

    reason: str
    help: str = ""
    breaks_rule: bool = False
    is_half_done: bool = False

    @property
    def text(self) -> str:
        """Return both in one line."""
        return f"{self.reason}; {self.help}" if self.help else self.reason


@dataclass(frozen=True, slots=True)
class WantedChange:
    """New values of components, all or none, by the names of the components or of their nodes; values are encoded."""

    parts: dict[str, str]
    by: str
    together: str = ""

    @classmethod
    def of(cls, parts: Mapping[str, NodeChange], by: str, together: str = "") -> Self:
        """Return a change that can be sent between processes."""
        return cls({name: b64encode(encode(one)).decode() for name, one in parts.items()}, by, together)

    def part(self, name: str) -> NodeChange:
        """Return what is wanted of a component."""
        return decode(NodeChange, b64decode(self.parts[name]))


class RobotRules(Protocol):
    """The rules about the whole robot, which live settings must keep."""

    def why_not(self, now: Configs, new: Configs) -> ChangeRefusal | None:
        """Return what `new` configurations break that was not broken before, where others have those of `now`."""
        ...
