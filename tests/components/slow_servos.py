"""Robots whose servos are read less often than they are on a robot, where a test is about something else."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from rbxcompose.compiler.plan.model import Instance


def with_slow_servos(instances: Iterable[Instance], rate: float = 25.0) -> list[Instance]:
    """Return instances whose driver of servos runs at a rate [Hz]: at 100 Hz it takes most of the time of a test."""
    return [
        replace(one, config=one.config.model_copy(update={"rate": rate})) if one.type == "servo_bus" else one
        for one in instances
    ]
