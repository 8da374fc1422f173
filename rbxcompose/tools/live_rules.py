"""The rules of `check` for the settings of a robot that runs: what a change would break that was not broken before."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.compiler.model.robot import NOTHING, Robot
from rbxcompose.compiler.setting_checks import SettingChecks
from rbxcompose.compiler.systems.cut_link import slow_stops
from rbxcompose.compiler.systems.model import PlacedRobot, System
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.runtime.folder import ChosenLayers
from rbxcompose.sdk.parameters import ChangeRefusal, Configs

InSystem = tuple[System, PlacedRobot]
"""A robot as a member of a system."""


@dataclass
class LiveRules:
    """The rules of a compiled robot, and of its system; a supervisor's judge asks them in a process of its own."""

    robot: Robot
    placed: InSystem | None = None

    @cached_property
    def _checks(self) -> SettingChecks:
        return SettingChecks(self.robot)

    def remade(self, file: str, layers: ChosenLayers) -> LiveRules | None:
        """Return the rules of the robot as its files are now, with these layers; None if they have errors."""
        placed = _placed(layers)
        found = _compiled(file, layers, placed)
        return None if found.robot is None or found.plan is None else LiveRules(found.robot, placed)

    def why_not(self, now: Configs, new: Configs) -> ChangeRefusal | None:
        """Return the first rule that `new` configurations break, where others have those of `now`."""
        written = {name: component.config for name, component in self.robot.components.items()}
        known = {(finding.code, finding.span) for finding in self._found({**written, **now})}
        found = self._found({**written, **now, **new})
        broken = next((finding for finding in found if (finding.code, finding.span) not in known), None)
        if broken is None:
            return None
        return ChangeRefusal(f"{broken.message} ({broken.code})", broken.help, breaks_rule=True)

    def _found(self, configs: Configs) -> list[Finding]:
        found = list(self._checks.report(configs))
        if self.placed is not None:
            system, placed = self.placed
            components = {name: one.configured(configs[name]) for name, one in self.robot.components.items()}
            found += slow_stops(system, replace(placed, robot=replace(self.robot, components=components)))
        return found


def compiled_with(file: str, layers: ChosenLayers, unsaved: Mapping[Path, str] = MappingProxyType({})) -> Compilation:
    """Compile a robot's file with layers that were chosen before."""
    return _compiled(file, layers, _placed(layers), unsaved)


def _placed(layers: ChosenLayers) -> InSystem | None:
    if not layers.system:
        return None
    system = compile_system(layers.system, environment=os.environ, real=layers.real, profiles=layers.system_profiles)
    return (system, system.robots[layers.member]) if layers.member in system.robots else None


def _compiled(
    file: str, layers: ChosenLayers, placed: InSystem | None, unsaved: Mapping[Path, str] = MappingProxyType({})
) -> Compilation:
    return compile_robot(
        file,
        profiles=layers.profiles,
        overlays=layers.overlays,
        sets=layers.sets,
        real=layers.real,
        environment=os.environ,
        unsaved=unsaved,
        outside=NOTHING if placed is None else placed[1].robot.outside,
        tries_profiles=bool(unsaved),  # what is about to be saved must not break a profile that runs another day
    )
