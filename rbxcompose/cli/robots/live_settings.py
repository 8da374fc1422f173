"""The settings of a robot that runs, beside its manifest as the files are now."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from rbxcompose.bus.names import resolve
from rbxcompose.cli.bus.parameter_nodes import ParameterNodes
from rbxcompose.cli.robots.live_rules import compiled_with
from rbxcompose.compiler import Compilation
from rbxcompose.composition.value_edits import is_same
from rbxcompose.config import Config, leaves, value_at
from rbxcompose.dataclass import dataclass
from rbxcompose.model.robot import Robot
from rbxcompose.msgs.rcl_interfaces import GetParameters, Parameter
from rbxcompose.params.core import UnsettableError, changed, dimension_of, settings
from rbxcompose.plan.model import Plan
from rbxcompose.runtime.folder import RobotState
from rbxcompose.units import Dimension


@dataclass(frozen=True, slots=True)
class LiveChange:
    """A setting that is another one than in the manifest; numbers are SI."""

    component: str
    name: str
    written: object
    live: object
    dimension: Dimension | None

    @property
    def path(self) -> str:
        """Return its name: `battery.runtime`."""
        return f"{self.component}.{self.name}"


@dataclass(frozen=True, slots=True)
class LiveSettings:
    """A compiled robot, and the configurations that its components have now, by name."""

    robot: Robot
    plan: Plan
    sources: Mapping[str, str]
    now: Mapping[str, Config]

    @property
    def changes(self) -> Iterator[LiveChange]:
        """Yield what is not as in the manifest."""
        for name, config in self.now.items():
            written = self.robot.components[name].config
            for one, field in leaves(config):
                old, new = value_at(written, one), value_at(config, one)
                if not is_same(old, new):
                    yield LiveChange(name, one, old, new, dimension_of(field))

    def node(self, component: str) -> str:
        """Return the name of a component on the bus: `/left/battery`."""
        return resolve(component, self.robot.manifest.bus.namespace or "")

    def plan_with(self, configs: Mapping[str, Config]) -> Plan:
        """Return the plan of the manifest, with other configurations of some components."""
        instances = (replace(one, config=configs.get(one.name, one.config)) for one in self.plan.instances)
        return replace(self.plan, instances=tuple(instances))


def compiled_as_it_runs(state: RobotState, unsaved: Mapping[Path, str] = MappingProxyType({})) -> Compilation:
    """Compile a robot that runs as its files are now, with the layers that it runs with.

    `unsaved` are texts in place of those of files, by their real paths.
    """
    return compiled_with(state.file, state.layers, unsaved)


def live_settings(nodes: ParameterNodes, state: RobotState) -> LiveSettings | None:
    """Return the settings of a robot that runs; None if its files have errors now."""
    found = compiled_as_it_runs(state)
    if found.robot is None or found.plan is None:
        return None
    return LiveSettings(found.robot, found.plan, found.sources, live_configs(nodes, found.robot))


def live_configs(nodes: ParameterNodes, robot: Robot) -> dict[str, Config]:
    """Return the configurations of all components that are on the bus, with the values that they have now."""
    wanted = {one: name for one, name in nodes_of(robot).items() if one in nodes.names}
    configs = {node: robot.components[name].config for node, name in wanted.items()}
    live = {node: [one.name for one in settings(config).values() if one.is_live] for node, config in configs.items()}
    asked = [node for node, names in live.items() if names]
    requests = [GetParameters.Request(names=tuple(live[node])) for node in asked]
    for node, answer in zip(asked, nodes.ask(asked, "get_parameters", GetParameters, requests), strict=True):
        pairs = zip(live[node], answer.values, strict=True)
        told = [Parameter(name=name, value=value) for name, value in pairs if value.type]
        with suppress(UnsettableError):  # its file has changed meanwhile
            configs[node] = changed(configs[node], told)
    return {name: configs[node] for node, name in wanted.items()}


def nodes_of(robot: Robot) -> dict[str, str]:
    """Return the components of a robot by the names of their nodes: `/left/battery`."""
    return {resolve(name, robot.manifest.bus.namespace or ""): name for name in robot.components}
