"""The section `ros2`: the ROS 2 of this robot, its Python, the environment of its programs, and its executables."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from pydantic import Field, model_validator

from rbxcompose.base.config import Config, LocalPath
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import OutsideError
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Reading

ZENOH = "rmw_zenoh_cpp"  # the middleware that joins the robot's bus by itself
_SOURCED_WITHIN = 30.0  # [s]


class RosModel(Config):
    """The ROS 2 of this robot."""

    setup: LocalPath = ""
    """Its setup file, `/opt/ros/kilted/setup.bash`, relative to the manifest's file."""
    python: LocalPath = ""
    """The Python that has rclpy, such as that of an environment of pip, in place of `setup`; without both, that of the
    environment in which `up` runs."""
    domain: int = Field(0, ge=0, le=232)
    """The domain of its nodes, if they are bridged; else that of `bus` counts."""
    discovery: Literal["localhost", "subnet"] = "localhost"
    """How far its nodes look for each other."""
    bridge: Literal["auto", "always", "never"] = "auto"
    """Whether its nodes are bridged; `auto` if their middleware is not `rmw_zenoh_cpp`."""

    @model_validator(mode="after")
    def _is_at_one_place(self) -> RosModel:
        if self.setup and self.python:
            raise ValueError("has 'setup' and 'python'; a ROS 2 is at one of them")
        return self


@dataclass(frozen=True, slots=True)
class RosInstallation:
    """A ROS 2 as its programs see it."""

    python: str
    environment: Mapping[str, str]
    domain: int
    is_bridged: bool

    def executable(self, package: str, name: str) -> str:
        """Return the path of an executable of a package.

        Raises:
            OutsideError: if there is none.
        """
        prefixes = [path for path in self.environment.get("AMENT_PREFIX_PATH", "").split(":") if path]
        for prefix in prefixes:
            path = Path(prefix, "lib", package, name)
            if path.is_file() and os.access(path, os.X_OK):
                return str(path)
        where = ", ".join(prefixes) or "AMENT_PREFIX_PATH, which is empty"
        raise OutsideError(f"there is no executable '{name}' of the package '{package}' in {where}")


def installation_of(model: RosModel, base: Mapping[str, str]) -> RosInstallation:
    """Find a ROS 2, whose programs get the environment `base` besides.

    Raises:
        OutsideError: if it is not there.
    """
    environment, python = dict(base), model.python
    if model.setup:
        environment |= _sourced(model.setup, base)
    if python:
        if not os.access(python, os.X_OK):
            raise OutsideError(f"there is no Python at {python} ('ros2: python')")
        folder = Path(python).parent
        environment["PATH"] = f"{folder}:{environment.get('PATH', os.defpath)}"
        paths = [str(folder.parent), *filter(None, [environment.get("AMENT_PREFIX_PATH")])]
        environment["AMENT_PREFIX_PATH"] = ":".join(paths)
    else:
        python = shutil.which("python3", path=environment.get("PATH")) or "python3"
    environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] = model.discovery.upper()
    is_ours = environment.get("RMW_IMPLEMENTATION") == ZENOH
    is_bridged = model.bridge == "always" or (model.bridge == "auto" and not is_ours)
    if is_bridged:
        environment["ROS_DOMAIN_ID"] = str(model.domain)
    else:  # on the robot's bus, that of the robot counts
        environment["RMW_IMPLEMENTATION"] = ZENOH
    for name in ("PYTHONHOME", "PYTHONPATH") if model.python else ():
        environment.pop(name, None)  # they are of our Python
    return RosInstallation(python, environment, model.domain, is_bridged)


def _sourced(setup: str, base: Mapping[str, str]) -> dict[str, str]:
    """Return the environment after a setup file, which only a shell can read."""
    command = ["bash", "-c", 'source "$1" > /dev/null && env -0', "bash", setup]
    try:
        ran = subprocess.run(
            command, env=dict(base), capture_output=True, timeout=_SOURCED_WITHIN, check=False, stdin=subprocess.DEVNULL
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise OutsideError(f"{setup} cannot be sourced: {error}") from error
    if ran.returncode:
        raise OutsideError(f"{setup} cannot be sourced: {ran.stderr.decode(errors='replace').strip()}")
    rows = (row.partition("=") for row in ran.stdout.decode(errors="replace").split("\0"))
    return {name: value for name, _, value in rows if name}


@section("ros2", RosModel, order=30)
def ros2(reading: Reading[RosModel]) -> RosModel | None:
    """Where ROS 2 is, for the components of type `ros2_node`.

    Example:
        ros2:
          setup: /opt/ros/kilted/setup.bash
          domain: 3
    """
    return reading.whole()
