"""The gate for requests of other processes: a limited number per second for each client, the rest is refused."""

from __future__ import annotations

from collections.abc import Callable

from rbxcompose.bus.allowance import Allowances
from rbxcompose.bus.attachment import AttachmentError, decode_attachment
from rbxcompose.bus.local import Participant
from rbxcompose.bus.refusals import RefusalReason, Refusals
from rbxcompose.bus.transport import Question

REQUESTS = 1000.0  # [Hz] of one asker, for services
GOALS = 50.0  # [Hz] of one client: a new goal replaces the one before, which costs more than a request
QUESTIONS = 100.0  # [Hz] to a window
BURST = 1.0  # [s]; as much as may be asked in this time may also be asked at once

SOMEBODY = b""  # who asks without saying who it is


class Gate:
    """Lets in what each asker may ask. It is called in threads of the transport and wakes nobody for the rest."""

    def __init__(self, node: Participant, name: str, rate: float, put: Callable[[Question], None]) -> None:
        """Hand at most `rate` requests a second [Hz] of each asker to `put`; `name` is what findings call it."""
        self.owner, self.name = node.owner, name
        self.refusals = Refusals()
        self._clock, self._rate, self._put = node.process.clock, rate, put
        self._allowances = Allowances(rate, BURST)
        self._gates = node.process.gates
        self._gates[self] = None

    def __call__(self, question: Question) -> None:
        """Let a request in, or refuse it."""
        try:
            asker = decode_attachment(question.attachment).gid
        except AttachmentError:  # a tool at a window; of a service it is refused where it is read
            asker = SOMEBODY
        if self._allowances.takes(asker, self._clock.now()):
            self._put(question)
        else:
            self.refusals.add(RefusalReason.TOO_MANY)
            question.fail(f"more than {self._rate:g} requests a second")

    def close(self) -> None:
        """Forget it; nothing may come any more."""
        self._gates.pop(self, None)
