"""The controllers of a bus: which are active, what each claims, how they are switched, what people may ask of them."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Command, Query, Refused
from rbxcompose.domains.servos.controller import Controller, ControllerConfig

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
        return shlex.join(["controller", "switch", *self.on, *(word for text in self.off for word in ("--off", text))])


@dataclass(frozen=True, slots=True)
class ScaleMotion(Command):
    """Let a controller follow its goals at a share of their speed from now on, also the one on its way; 0 holds it."""

    about = BUS
    written = "controller speed {0.controller} {0.share:.4g}"
    component: str
    controller: str
    share: float


@dataclass(frozen=True, slots=True)
class RecallControllers(Command):
    """What controllers have kept, by their names, for those that start again."""

    about = BUS
    memories: Mapping[str, Any]


class ControllerManager:
    """Controllers by name; no joint is led by two active ones."""

    def __init__(self, controllers: Mapping[str, Controller[ControllerConfig]]) -> None:
        self.controllers = dict(controllers)
        self._active = {name for name, controller in self.controllers.items() if controller.config.start == "active"}
        self._leaving = set[str]()  # switched off, and not at rest yet

    @property
    def active(self) -> list[Controller[ControllerConfig]]:
        """Return the active controllers, in the order of the manifest."""
        return [controller for name, controller in self.controllers.items() if name in self._active]

    @property
    def leading(self) -> list[Controller[ControllerConfig]]:
        """Return the active controllers, and those that still bring joints to rest that nobody else leads."""
        taken = {joint for controller in self.active for joint in controller.config.claimed}
        leaving = [self.controllers[name] for name in self._leaving]
        self._leaving = {one.name for one in leaving if one.leads and not taken & {*one.config.claimed}}
        return [controller for name, controller in self.controllers.items() if name in self._active | self._leaving]

    def is_active(self, name: str) -> bool:
        """Return whether a controller leads its joints."""
        return name in self._active

    def leader(self, joint: str) -> str:
        """Return the active controller that moves a joint now, or nothing."""
        return next((item.name for item in self.leading if joint in item.config.claimed and item.leads), "")

    def let_go(self, joint: str, now: float, reason: str) -> None:
        """Have a joint left alone, which has lost its torque."""
        for controller in self.active:
            if joint in controller.config.claimed:
                controller.let_go(joint, now, reason)

    def objection(self, on: Iterable[str], off: Iterable[str]) -> str:
        """Return why controllers cannot be switched on and off, or nothing."""
        on, off = list(on), list(off)
        if unknown := [name for name in (*on, *off) if name not in self.controllers]:
            return f"there is no controller '{unknown[0]}'; there are {', '.join(self.controllers)}"
        if both := set(on) & set(off):
            return f"controller '{min(both)}' cannot be switched on and off at once"
        wanted = (self._active - set(off)) | set(on)
        owners: dict[str, str] = {}
        for name in self.controllers:
            for joint in self.controllers[name].config.claimed if name in wanted else ():
                if (other := owners.setdefault(joint, name)) != name:
                    return f"controllers '{other}' and '{name}' both lead joint '{joint}': switch one of them off"
        return ""

    def switch(self, on: Iterable[str], off: Iterable[str], now: float) -> Iterator[str]:
        """Switch controllers on and off; yield a sentence for each that changes.

        What those that are switched off do ends, and their joints come to rest.

        Raises:
            Refused: if there is an `objection`.
        """
        on, off = list(on), list(off)
        if objection := self.objection(on, off):
            raise Refused(objection)
        for name in off:
            if name in self._active:
                self.controllers[name].halt(now, f"controller '{name}' was switched off")
                self._active.discard(name)
                self._leaving.add(name)
                yield f"controller '{name}' is inactive"
        for name in on:
            if name not in self._active:
                self._active.add(name)
                self._leaving.discard(name)
                yield f"controller '{name}' is active"

    def set_pace(self, name: str, share: float) -> str:
        """Let a controller follow its goals at a share of their speed, from 0 to 1; return that in words.

        Raises:
            Refused: if it cannot.
        """
        if name not in self.controllers:
            raise Refused(f"there is no controller '{name}'; there are {', '.join(self.controllers)}")
        if problem := self.controllers[name].set_pace(share):
            raise Refused(problem)
        return f"'{name}' follows goals at {share:.0%} of the speed" if share else f"'{name}' holds: the speed is 0 %"
