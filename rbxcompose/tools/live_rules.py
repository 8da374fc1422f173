"""The rules of `check` for the settings of a robot that runs: what a change would break that was not broken before."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from types import MappingProxyType

from rbxcompose.base.dataclass import dataclass
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.compiler.model.robot import NOTHING, Robot
from rbxcompose.compiler.setting_checks import SettingChecks
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.runtime.folder import ChosenLayers
from rbxcompose.sdk.parameters import ChangeRefusal, Configs


@dataclass
class LiveRules:
    """The rules of a compiled robot; a supervisor's judge asks them in a process of its own."""

    robot: Robot

    @cached_property
    def _checks(self) -> SettingChecks:
        return SettingChecks(self.robot)

    def remade(self, file: str, layers: ChosenLayers) -> LiveRules | None:
        """Return the rules of the robot as its files are now, with these layers; None if they have errors."""
        found = compiled_with(file, layers)
        return None if found.robot is None or found.plan is None else LiveRules(found.robot)

    def why_not(self, now: Configs, new: Configs) -> ChangeRefusal | None:
        """Return the first rule that `new` configurations break, where others have those of `now`."""
        written = {name: component.config for name, component in self.robot.components.items()}
        before, after = {**written, **now}, {**written, **now, **new}
        known = {(finding.code, finding.span) for finding in self._checks.report(before)}
        found = self._checks.report(after)
        broken = next((finding for finding in found if (finding.code, finding.span) not in known), None)
        if broken is None:
            return None
        return ChangeRefusal(f"{broken.message} ({broken.code})", broken.help, breaks_rule=True)


def compiled_with(file: str, layers: ChosenLayers, unsaved: Mapping[Path, str] = MappingProxyType({})) -> Compilation:
    """Compile a robot's file with layers that were chosen before."""
    outside = NOTHING
    if layers.system:
        system = compile_system(
            layers.system, environment=os.environ, real=layers.real, profiles=layers.system_profiles
        )
        outside = system.robots[layers.member].robot.outside if layers.member in system.robots else NOTHING
    return compile_robot(
        file,
        profiles=layers.profiles,
        overlays=layers.overlays,
        sets=layers.sets,
        real=layers.real,
        environment=os.environ,
        unsaved=unsaved,
        outside=outside,
        processes=int(bool(unsaved)),  # what is about to be saved must not break a profile that runs another day
    )
