"""The section `simulator`: what moves the simulated robot."""

from __future__ import annotations

from typing import Literal, cast

from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import OVERLAY, ROBOT, Reading
from rbxcompose.manifest.validate import validate

IDEAL, PHYSICS = "ideal", "physics"
SIMULATORS = cast("type[str]", Literal["ideal", "physics"])  # pydantic takes it as a type, type checkers do not


@section("simulator", SIMULATORS, order=62, files=(ROBOT, OVERLAY))
def simulator(reading: Reading[str]) -> str:
    """What moves the robot in its `world`: `ideal`, which is exact and fast, or `physics`, with masses and friction.

    Example:
        world: rbx:worlds/one_wall.yaml
        simulator: physics
    """
    if reading.node is None:
        return IDEAL
    return validate(SIMULATORS, reading.node, (simulator.name,), reading.report) or IDEAL
