"""Where a robot's batteries publish their levels."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.plan.model import Plan
from rbxcompose.runtime.folder import Gauge
from rbxcompose.sdk.capabilities import Drains
from rbxcompose.sdk.ports import Out
from rbxcompose.sdk.registry import component_type, declared


def gauges_of(plan: Plan) -> dict[str, Gauge]:
    """Return the gauges of the batteries, by component."""
    return dict(_gauges(plan))


def _gauges(plan: Plan) -> Iterator[tuple[str, Gauge]]:
    for one in plan.instances:
        for drains in declared(one.type, one.config, Drains):
            port = component_type(one.type).ports(one.config)[drains.level]
            if isinstance(port, Out) and port.interface is not None:
                yield one.name, Gauge(one.topic(drains.level), port.interface.TYPE, port.unit)
