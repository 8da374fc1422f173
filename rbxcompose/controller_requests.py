"""What people may ask of the controllers of a running robot."""

from __future__ import annotations

import shlex

from rbxcompose.dataclass import dataclass
from rbxcompose.requests import Command, Query

BUS = "servo_bus"


@dataclass(frozen=True, slots=True)
class ControllerState:
    """A controller on a running robot."""

    name: str
    type: str
    is_active: bool
    joints: tuple[str, ...]
    note: str = ""


@dataclass(frozen=True, slots=True)
class ListControllers(Query[tuple[ControllerState, ...]]):
    """Return the controllers of a bus."""

    about = BUS
    component: str


@dataclass(frozen=True, slots=True)
class SwitchControllers(Command):
    """Switch controllers of a bus on and off, all at once or not at all."""

    about = BUS
    component: str
    on: tuple[str, ...] = ()
    off: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        return shlex.join(["controller", "switch", *self.on, *(word for one in self.off for word in ("--off", one))])


@dataclass(frozen=True, slots=True)
class ScaleMotion(Command):
    """Let a controller follow its goals at a share of their speed from now on, also the one on its way; 0 holds it."""

    about = BUS
    component: str
    controller: str
    share: float

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        return shlex.join(["controller", "speed", self.controller, f"{self.share:.4g}"])
