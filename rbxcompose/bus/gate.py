"""The gate for requests of other processes: it limits the rate of each client and refuses the rest."""

from __future__ import annotations

from collections.abc import Callable

from rbxcompose.bus.allowance import Allowances
from rbxcompose.bus.attachment import AttachmentError, decode_attachment
from rbxcompose.bus.local import Participant
from rbxcompose.bus.refusals import RefusalReason, Refusals
from rbxcompose.bus.transport import Question

REQUESTS = 1000.0  # [Hz] per client, for services
GOALS = 50.0  # [Hz] per client: a new goal replaces the one before, which costs more than a request
QUESTIONS = 100.0  # [Hz] to a window
BURST = 1.0  # [s]; the requests allowed in this time may also come all at once

SOMEBODY = b""  # a client that does not identify itself


class Gate:
    """Lets in what each client may request. It runs in threads of the transport and wakes nobody for the rest."""

    def __init__(self, node: Participant, name: str, rate: float, put: Callable[[Question], None]) -> None:
        """Pass at most `rate` requests per second [Hz] of each client to `put`; `name` is used in findings."""
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
        except AttachmentError:  # a tool at a window; a service refuses such a request when it reads it
            asker = SOMEBODY
        if self._allowances.takes(asker, self._clock.now()):
            self._put(question)
        else:
            self.refusals.add(RefusalReason.TOO_MANY)
            question.fail(f"more than {self._rate:g} requests a second")

    def close(self) -> None:
        """Remove the gate; no more requests may arrive."""
        self._gates.pop(self, None)
