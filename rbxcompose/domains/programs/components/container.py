"""A container of others: an image that an engine runs, started, watched and stopped as a component."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, model_validator

from rbxcompose.base.config import Config, LocalPath, bundle_path
from rbxcompose.base.requests import OutsideError
from rbxcompose.domains.programs.child import StartOrder
from rbxcompose.domains.programs.components.program import ProgramLimits, RunConfig, Runner
from rbxcompose.domains.programs.runnable import NoEngineError, ask_for_real, engine_of
from rbxcompose.runtime.processes import describe_exit
from rbxcompose.sdk import Capability, component
from rbxcompose.sdk.capabilities import RunsContainer, Setting

_INSIDE = "/rbxcompose/zenoh.json5"
_FILES = ("ZENOH_CONFIG", "ZENOH_SESSION_CONFIG_URI")
_ENDS = {
    125: "the engine could not run it",
    126: "its command cannot be run in the image",
    127: "its command is not in the image",
    137: "was killed, perhaps for its memory",
}


Paths = TypeVar("Paths", dict[str, "MountModel"], tuple[str, ...])


def _as_folder(value: Any) -> Any:
    return {"folder": value} if isinstance(value, str) else value


def _are_whole(paths: Paths) -> Paths:
    for path in paths:
        if not path.startswith("/") or "," in path:
            raise ValueError(f"'{path}' must be a path that begins with '/' and has no comma")
    return paths


def _is_word(text: str) -> str:
    if not text[:1].isalnum() or any(map(str.isspace, text)):
        raise ValueError("must be one word that begins with a letter or a digit")
    return text


class MountModel(Config):
    """A folder or a file of this machine in a container."""

    folder: LocalPath
    """Its path here, relative to the manifest's file."""
    writable: bool = False
    """Whether the container may write there."""

    @model_validator(mode="after")
    def _travels(self, info: ValidationInfo) -> MountModel:
        if not self.writable:
            bundle_path(self.folder, info)
        return self


EngineWord = Annotated[str, AfterValidator(_is_word)]
Mount = Annotated[MountModel, BeforeValidator(_as_folder, json_schema_input_type=MountModel | str)]


class ContainerLimits(ProgramLimits):
    """What a container may use; the engine sees to it."""

    nice: int = Field(0, ge=0, le=0)
    """Always 0: engines have no such limit; give it fewer `cpus`."""
    cpus: float | None = Field(None, gt=0)
    """Processors' worth of time: 0.5 is half of one."""


class ContainerConfig(RunConfig):
    """What is run."""

    image: EngineWord
    """The image; it must be on this machine when the robot starts."""
    arguments: tuple[str, ...] = ()
    """What its entry point gets, or the command in it."""
    engine: Literal["auto", "docker", "podman"] = "auto"
    """What runs it; `auto` takes the first that works."""
    mounts: Annotated[dict[str, Mount], AfterValidator(_are_whole)] = {}
    """Folders and files of this machine by their path in the container: a path, or a map with `folder` and
    `writable`."""
    devices: Annotated[tuple[str, ...], AfterValidator(_are_whole)] = ()
    """Devices of this machine that it may open: `/dev/video0`."""
    network: EngineWord = "host"
    """Its network; only that of the host reaches the robot's bus."""
    limits: ContainerLimits = ContainerLimits()
    """What it may use."""


@component("container")
class Container(Runner[ContainerConfig]):
    """Runs an image of others with docker or podman, with the ports that the manifest declares for it.

    Example:
        detector: {type: container, image: "example.org/detector:1.2", publishes: {found: std_msgs/String}}
    """

    @classmethod
    def capabilities(cls, config: ContainerConfig) -> tuple[Capability, ...]:
        """Return what the manifest says that it can do, and what `up` looks for."""
        found = RunsContainer(Setting(config.image, "image"), Setting(config.engine, "engine"))
        return (*config.declared_capabilities(), found)

    @property
    def most_memory(self) -> float | None:
        """Return nothing: the engine sees to it."""
        return None

    def described(self, status: int) -> str:
        """Return in words how it has ended; engines have exit codes of their own."""
        code = os.waitstatus_to_exitcode(status)
        return f"{describe_exit(status)}: {_ENDS[code]}" if code in _ENDS else describe_exit(status)

    def order(self, environment: Mapping[str, str]) -> StartOrder:
        """Return the call of the engine; a container that a dead predecessor has left is removed first."""
        try:
            engine = engine_of(self.config.engine, environment.get("PATH", os.defpath), ask_for_real)
        except NoEngineError as error:
            raise OutsideError(f"cannot be started: {error}") from error
        name = f"rbxcompose-{self.context.address.robot}-{self.name}"
        ask_for_real(removal(engine, name))
        return order_of(self.config, engine, name, environment, self.joining)


def removal(engine: str, name: str) -> tuple[str, ...]:
    """Return the command that ends and removes a container, if it is there."""
    return engine, "rm", "--force", name


def order_of(
    config: ContainerConfig, engine: str, name: str, environment: Mapping[str, str], joining: Mapping[str, str]
) -> StartOrder:
    """Return the call of an engine.

    The client gets the whole `environment`, the container what is `joining` of it. Values are passed by their names, so
    that others on this machine do not see them in the list of processes.
    """
    command = [engine, *_options(config, engine, name, joining), config.image, *config.arguments]
    number = int(signal.Signals[config.stop.signal])
    return StartOrder(command, "/", environment, number, config.stop.within, cleanup=removal(engine, name))


def _options(config: ContainerConfig, engine: str, name: str, joining: Mapping[str, str]) -> Iterator[str]:
    yield from ("run", "--rm", "--name", name, "--network", config.network, "--pull", "never")
    yield from ("--stop-signal", config.stop.signal)
    if os.path.basename(engine) == "docker":
        yield "--init"  # as process 1, a program without a handler would ignore the signal
    limits = config.limits
    if limits.memory is not None:
        yield from ("--memory", f"{limits.memory:g}m")
    if limits.cpus is not None:
        yield from ("--cpus", f"{limits.cpus:g}")
    if limits.cores:
        yield from ("--cpuset-cpus", ",".join(map(str, limits.cores)))
    if limits.open_files is not None:
        yield from ("--ulimit", f"nofile={limits.open_files}")
    for device in config.devices:
        yield from ("--device", device)
    if file := joining.get(_FILES[0]):
        yield from ("--mount", f"type=bind,source={file},target={_INSIDE},readonly")
    for place, mount in config.mounts.items():
        yield from ("--mount", f"type=bind,source={mount.folder},target={place}{'' if mount.writable else ',readonly'}")
    for variable in joining:
        is_file = variable in _FILES and variable not in config.environment
        yield from ("--env", f"{variable}={_INSIDE}" if is_file else variable)
