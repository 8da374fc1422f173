"""Outputs with a declared rate: each message is counted, and its stamp is compared with the clock."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rbxcompose.clock import Clock
from rbxcompose.diagnostics.updater import CompositeTask, DiagnosticTask, FrequencyTask, StampTask
from rbxcompose.msgs.stamps import NANOSECONDS, to_nanoseconds
from rbxcompose.sdk.bound import Sender
from rbxcompose.sdk.ports import Out


def paced(sender: Sender[Any], port: Out[Any], clock: Clock, watch: Callable[[str, DiagnosticTask], None]) -> Any:
    """Return `sender`, or one that counts if its port declares a rate."""
    if port.rate is None:
        return sender
    stamps = StampTask() if port.interface is not None and "header" in port.interface.FIELDS else None
    made = _Paced(sender, FrequencyTask(port.rate), stamps, clock)
    watch(port.topic.lstrip("/"), made.task)
    return made


class _Paced:
    """A publisher that counts its messages."""

    def __init__(self, sender: Sender[Any], rate: FrequencyTask, stamps: StampTask | None, clock: Clock) -> None:
        self._sender, self._rate, self._stamps, self._clock = sender, rate, stamps, clock
        self.task = rate.status if stamps is None else CompositeTask(rate.status, stamps.status).status

    @property
    def is_wanted(self) -> bool:
        """Return whether anything would receive a message; a component that asks in vain is as punctual."""
        if not (wanted := self._sender.is_wanted):
            self._rate.tick()
        return wanted

    def __call__(self, message: Any, /) -> None:
        self._rate.tick()
        if self._stamps is not None:
            self._stamps.tick(to_nanoseconds(message.header.stamp) / NANOSECONDS, self._clock.stamp() / NANOSECONDS)
        self._sender(message)
