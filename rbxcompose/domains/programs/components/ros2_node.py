"""A ROS 2 node as a component, whatever its middleware."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import (
    BeforeValidator,
    Field,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from rbxcompose.base.config import COMPONENT, CONTENTS, LocalFiles, LocalPath, Name, Refers
from rbxcompose.base.files import replace_file
from rbxcompose.base.requests import OutsideError
from rbxcompose.bus.names import resolve
from rbxcompose.domains.programs.bridge import ros_bridge
from rbxcompose.domains.programs.bridge.ends import ProgramEnd, ends_of, parameters_of
from rbxcompose.domains.programs.child import StartOrder
from rbxcompose.domains.programs.components.program import (
    CommandWords,
    RunConfig,
    Runner,
    StopModel,
    bundle_command,
    order_of,
)
from rbxcompose.domains.programs.sections.ros2 import RosInstallation, RosModel, installation_of, ros2
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.reader import read_source
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.sdk import Capability, component
from rbxcompose.sdk.capabilities import RunsRosNode, Setting

Parameter = bool | int | float | str | list[bool] | list[int] | list[float] | list[str] | dict[str, Any]


def _from_section(value: Any, info: ValidationInfo) -> Any:
    """Fill in what the section `ros2` says."""
    contents = (info.context or {}).get(CONTENTS)
    whole = contents.of(ros2) if contents is not None else None
    if not isinstance(value, Mapping) or whole is None:
        return value
    return {**whole.model_dump(), **value}


def _read(value: Any, whole: ValidatorFunctionWrapHandler, info: ValidationInfo) -> str:
    """Read a file beside the manifest, which then belongs to the robot; a whole path is one on its computer."""
    path: str = whole(value)
    contents = (info.context or {}).get(CONTENTS)
    if contents is None or os.path.isabs(value):
        return path
    text, findings = read_source(
        Path(path), shown_name(Path(path)), contents.documents.sources, what="a parameter file"
    )
    if text is None:
        raise PydanticCustomError("unreadable", "{reason}", {"reason": findings[0].message})
    return path


class Ros2NodeConfig(RunConfig):
    """Which node, and how it is started."""

    stop: StopModel = StopModel(signal="SIGINT")
    """How it is stopped; by SIGINT, as `ros2 launch` does, if nothing else is said."""

    package: str = ""
    """The package of its executable."""
    executable: str = ""
    """Its executable."""
    command: CommandWords | None = None
    """Its words, in place of `package` and `executable`. Without all three it is started by something else, and only
    its topics, services and actions are bridged."""
    arguments: tuple[str, ...] = ()
    """Further words of its command line."""
    name: str = Field("", pattern=r"^([A-Za-z_]\w*)?$")
    """Its name in ROS, if that is not the component's."""
    namespace: str = Field("", pattern=r"^(/[A-Za-z_]\w*)*$")
    """Its namespace in ROS."""
    remaps: dict[str, str] = {}
    """Names that it uses, each with the name in its place."""
    parameters: dict[str, Parameter] = {}
    """Its parameters."""
    parameter_files: tuple[Annotated[LocalFiles, WrapValidator(_read)], ...] = ()
    """Files with more of them; `parameters` count before these."""
    folder: LocalPath = Field(".", validate_default=True)
    """Where it runs, relative to the manifest's file."""
    configures: tuple[Annotated[Name, Refers(COMPONENT)], ...] = ()
    """Components whose parameters it reads and sets."""
    ros2: Annotated[RosModel, BeforeValidator(_from_section, json_schema_input_type=RosModel)] = Field(
        default_factory=dict, validate_default=True
    )
    """Its ROS 2, where that is another one than the section `ros2` says."""

    @field_validator("folder")
    @classmethod
    def _brings_what_it_names(cls, folder: str, info: ValidationInfo) -> str:
        return bundle_command([*(info.data.get("command") or ()), *info.data.get("arguments", ())], folder, info)

    @model_validator(mode="after")
    def _is_one(self) -> Ros2NodeConfig:
        if bool(self.package) != bool(self.executable):
            raise ValueError("needs 'package' and 'executable' together")
        if self.package and self.command is not None:
            raise ValueError("has 'command' and 'package'; one of them starts it")
        return self

    @property
    def is_started(self) -> bool:
        """Return whether the component starts it."""
        return bool(self.package) or self.command is not None


@component("ros2_node")
class Ros2Node(Runner[Ros2NodeConfig]):
    """Runs a node of ROS 2, and bridges its topics, services and actions if its middleware is not Zenoh.

    Example:
        lidar: {type: ros2_node, package: a_lidar, executable: driver, publishes: {scan: sensor_msgs/LaserScan}}
    """

    @classmethod
    def capabilities(cls, config: Ros2NodeConfig) -> tuple[Capability, ...]:
        """Return what the manifest says that it can do, and what `up` looks for."""
        found = RunsRosNode(Setting(config.ros2.python, "ros2.python"), Setting(config.ros2.setup, "ros2.setup"))
        return (*config.declared_capabilities(), found)

    def configure(self) -> None:
        """Prepare for its ROS 2."""
        super().configure()
        self.bridge: ros_bridge.RosBridge | None = None
        self.channels: list[int] = []
        self.ros: RosInstallation | None = None

    @property
    def joins_bus(self) -> bool:
        """Return whether its middleware is Zenoh."""
        return self.ros is not None and not self.ros.is_bridged and self.config.is_started

    @property
    def node_name(self) -> str:
        """Return its whole name in ROS."""
        return f"{self.config.namespace}/{self.config.name or self.name}"

    def order(self, environment: Mapping[str, str]) -> StartOrder | None:
        """Return its command, with the arguments of ROS."""
        config = self.config
        self.ros = installation_of(config.ros2, environment)
        if not config.is_started:
            return None
        if config.command is not None:
            command = [*config.command]
        else:
            command = [self.ros.executable(config.package, config.executable)]
        words = [*command, *config.arguments, *self._ros_arguments()]
        return order_of(config, words, config.folder, {**self.ros.environment, **config.environment})

    def _ros_arguments(self) -> Iterator[str]:
        config = self.config
        yield "--ros-args"
        yield from ("-r", f"__node:={config.name or self.name}")
        if config.namespace:
            yield from ("-r", f"__ns:={config.namespace}")
        for old, new in config.remaps.items():
            yield from ("-r", f"{old}:={new}")
        for file in config.parameter_files:
            yield from ("--params-file", file)
        if config.parameters:
            written = RobotFolder.of(self.context.address.robot).path / f"{self.name}.parameters.yaml"
            text = json.dumps({"/**": {"ros__parameters": config.parameters}}, indent=2)  # JSON is YAML
            replace_file(written, text.encode())
            yield from ("--params-file", str(written))

    def connect(self) -> None:
        """Let its topics, services, actions and parameters pass the bridge."""
        if self.ros is None or not self.ros.is_bridged:
            return
        self.bridge = ros_bridge.joined(self.ros, self.context.address, self.name)
        self.channels = self.bridge.add(self.name, self._ends())

    def _ends(self) -> Iterator[ProgramEnd]:
        for name, port in self._elsewhere():
            yield from ends_of(port, str(self.bound[name]))
        yield from parameters_of(self.node_name, "serves")
        for other in self.config.configures:
            yield from parameters_of(resolve(other, self.context.address.namespace), "calls")

    def attend(self) -> None:
        """Report what the bridge cannot do, and restart with it."""
        if self.bridge is None:
            return
        for text in self.bridge.problems(self.channels):
            self.warn(text)
        if (how := self.bridge.hear()) and not self.is_ending:
            raise OutsideError(how)

    def disconnect(self) -> None:
        """Leave the bridge."""
        if (joined := self.bridge) is not None:
            self.bridge = None
            joined.remove(self.channels)
            ros_bridge.left(joined, self.name)
