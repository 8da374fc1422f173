"""Reading many servos at once, so that one that is silent or corrupt costs only itself.

The SDK's own group reads stop at the first failure and throw away the replies of others; here each reply is sorted by
its id until all have come or their time is over.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

from rbxcompose.actuation.bus import ServoReading
from rbxcompose.actuation.dynamixel_packets import Answer, NoAnswer, Packets, PacketsTwo
from rbxcompose.actuation.dynamixel_port import BlockingPort
from rbxcompose.actuation.groups import request_groups
from rbxcompose.actuation.servo_models import ServoModel
from rbxcompose.actuation.transfers import ReadPlan, Stretch


class GroupRead:
    """One read of several servos: by id, how it is read and what has come of it so far."""

    def __init__(self, plans: Mapping[int, ReadPlan]) -> None:
        self.plans = plans
        self.open = {servo: plan.stretches[0] for servo, plan in plans.items()}
        """The next stretch of each servo that is not whole."""
        self.corrupt: set[int] = set()
        """Those whose reply was corrupt, or may have been."""
        self._parts: dict[int, list[bytes]] = {servo: [] for servo in plans}
        self._last: dict[int, tuple[float, int]] = {}  # time [s] and error byte of the last reply

    def next_of(self, ids: Iterable[int]) -> dict[int, Stretch]:
        """Return the next stretch of each of these servos that is not whole."""
        return {servo: self.open[servo] for servo in ids if servo in self.open}

    def take(self, answer: Answer, now: float) -> None:
        """Keep the next stretch of a servo."""
        parts, stretches = self._parts[answer.id], self.plans[answer.id].stretches
        parts.append(answer.data)
        self._last[answer.id] = now, answer.error
        if len(parts) < len(stretches):
            self.open[answer.id] = stretches[len(parts)]
        else:
            del self.open[answer.id]

    def reading(self, id: int) -> ServoReading:
        """Return what a servo told, once it is whole."""
        stamp, alert = self._last[id]
        return ServoReading(self.plans[id].values(self._parts[id], alert), stamp, alert)


class ServoReader:
    """Carries out group reads on a port; `strays` counts replies that nobody waited for."""

    def __init__(self, packets: Mapping[int, Packets], clock: Callable[[], float]) -> None:
        self.strays = 0
        self._packets, self._clock = packets, clock

    def attempt(
        self, port: BlockingPort, read: GroupRead, models: Mapping[int, ServoModel], *, is_fast: bool = False
    ) -> None:
        """Ask servos once, by id, for all that they have not told yet; one that fails is not asked for the rest."""
        for protocol, group in request_groups(models):
            wanted = read.next_of(group)
            while wanted:
                found = self._exchange(port, protocol, wanted, read, is_fast=is_fast)
                wanted = read.next_of(found)

    def _exchange(
        self, port: BlockingPort, protocol: int, wanted: Mapping[int, Stretch], read: GroupRead, *, is_fast: bool
    ) -> list[int]:
        """Ask for one stretch of each servo; return those that answered."""
        packets = self._packets[protocol]
        missing = dict(wanted)
        if isinstance(packets, PacketsTwo) and is_fast and len(missing) > 1 and len(set(missing.values())) == 1:
            answers = _fast(port, packets, missing)
        else:
            answers = _plain(port, packets, missing)
        for answer in answers:
            if answer is NoAnswer.CORRUPT:
                read.corrupt |= missing.keys()
            elif isinstance(answer, Answer) and self._is_wanted(answer, missing):
                del missing[answer.id]
                read.take(answer, self._clock())
        return [servo for servo in wanted if servo not in missing]

    def _is_wanted(self, answer: Answer, missing: Mapping[int, Stretch]) -> bool:
        if answer.id in missing and len(answer.data) == missing[answer.id].length:
            return True
        self.strays += 1
        return False


def _plain(port: BlockingPort, packets: Packets, missing: Mapping[int, Stretch]) -> Iterator[Answer | NoAnswer]:
    """Yield replies until nothing is missing or the time of all replies is over."""
    if not packets.ask(port, missing):
        return
    length = sum(packets.reply + one.length for one in missing.values())
    port.wait_for(length, len(missing))
    while missing:
        answer = packets.receive(port)
        yield answer
        if answer is NoAnswer.SILENCE:
            break


def _fast(port: BlockingPort, packets: PacketsTwo, missing: Mapping[int, Stretch]) -> Iterator[Answer | NoAnswer]:
    [length] = {one.length for one in missing.values()}
    if packets.ask(port, missing, is_fast=True):
        port.wait_for(packets.reply + len(missing) * (length + 4), len(missing))
        yield from packets.receive_fast(port, length)


def in_other_order(ids: Sequence[int]) -> list[int]:
    """Return ids with the first one last: it may have kept those behind it from answering."""
    return [*ids[1:], *ids[:1]]
