"""How far the clock of another host is from ours, from the times at which reports were sent and arrived. Pure.

As in NTP (RFC 5905, section 8): of two messages, one each way, the four stamps give the offset and the round trip. The
offset is wrong by at most half the round trip, so the sample with the shortest one counts.
"""

from __future__ import annotations

from collections import deque

from rbxcompose.dataclass import dataclass

SAMPLES = 40  # of ten seconds, in which the clocks of two computers drift by less than a millisecond
SET = 0.1  # [s] by which a clock is set rather than drifts
TOO_FAR = 0.02  # [s] between the clocks of two hosts: a robot at 0.5 m/s is then seen 1 cm from where it is


@dataclass(frozen=True, slots=True)
class ClockOffset:
    """The clock of a host minus ours [s], and by how much this may be wrong [s]."""

    offset: float
    uncertainty: float

    @property
    def is_too_far(self) -> bool:
        """Return whether the clocks are surely too far apart."""
        return abs(self.offset) - self.uncertainty > TOO_FAR

    def differs_from(self, other: ClockOffset) -> bool:
        """Return whether a clock was surely set between the two."""
        return abs(self.offset - other.offset) > SET + self.uncertainty + other.uncertainty

    @property
    def words(self) -> str:
        """Return it for people: `3.2 ms ahead of ours (± 0.4 ms)`."""
        side = "ahead of" if self.offset > 0 else "behind"
        return f"{abs(self.offset) * 1e3:.1f} ms {side} ours (± {self.uncertainty * 1e3:.1f} ms)"


@dataclass(frozen=True, slots=True)
class Echo:
    """When the last report of a host was sent by its clock, and when it arrived by ours [ns since the epoch]."""

    sent: int
    arrived: int


class OffsetFilter:
    """Measures the clock of one host."""

    def __init__(self) -> None:
        self._samples: deque[ClockOffset] = deque(maxlen=SAMPLES)

    def feed(self, own: Echo, answer: Echo) -> ClockOffset | None:
        """Take when a report of ours was sent and arrived there, and when the answer was sent there and arrived here.

        Returns the best of the last measurements; None without any.
        """
        there, here = answer.sent - own.arrived, answer.arrived - own.sent  # both are positive times
        round_trip = here - there
        if round_trip >= 0:  # else a clock was set between the two
            offset = ((own.arrived - own.sent) + (answer.sent - answer.arrived)) / 2
            sample = ClockOffset(offset * 1e-9, round_trip * 1e-9 / 2)
            if self._samples and sample.differs_from(self._samples[-1]):
                self._samples.clear()
            self._samples.append(sample)
        return min(self._samples, key=lambda one: one.uncertainty, default=None)
