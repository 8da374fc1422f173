"""Compare what a component sends with what it sent in the recording, up to the first difference."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from typing import Any

from rbxcompose.clock import NANOSECONDS
from rbxcompose.dataclass import dataclass
from rbxcompose.msgs import registry
from rbxcompose.msgs.cdr import CdrError, decode
from rbxcompose.msgs.events import TOPIC
from rbxcompose.msgs.plain import to_plain
from rbxcompose.recording.message import Recorded
from rbxcompose.replay.aliases import Aliases

NOTHING = "nothing"


@dataclass(frozen=True, slots=True)
class RunDifference:
    """The first difference from the recording: robot time [s], topic, field (empty: the message as a whole)."""

    time: float
    topic: str
    field: str
    recorded: str
    now: str


class RunComparison:
    """Compares both sides as they arrive."""

    def __init__(self, aliases: Aliases) -> None:
        self.equal = 0  # number of equal messages
        self.difference: RunDifference | None = None
        self._aliases = aliases
        self._recorded: deque[Recorded] = deque()
        self._now: deque[Recorded] = deque()

    def expect(self, record: Recorded) -> None:
        """Take a message of the recording."""
        self._recorded.append(record)
        self._compare()

    def sent(self, record: Recorded) -> None:
        """Take a message sent now."""
        self._now.append(record)
        self._compare()

    def end(self, cut_at: float) -> None:
        """Finish: what is left has no counterpart, unless the recording ends there [ns]."""
        if self.difference is not None:
            return
        if self._recorded and (record := self._recorded[0]).log_time < cut_at:
            self.difference = _whole(record, f"a message on {record.topic.name}", NOTHING)
        if self._now and (record := self._now[0]).log_time < cut_at:
            self.difference = _whole(record, NOTHING, f"a message on {record.topic.name}")

    def _compare(self) -> None:
        while self._recorded and self._now and self.difference is None:
            recorded, now = self._recorded.popleft(), self._now.popleft()
            self.difference = self._between(recorded, now)
            self.equal += self.difference is None

    def _between(self, recorded: Recorded, now: Recorded) -> RunDifference | None:
        if recorded.topic.name != now.topic.name:
            first = min(recorded, now, key=lambda one: one.log_time)
            return _whole(first, f"a message on {recorded.topic.name}", f"a message on {now.topic.name}")
        if recorded.log_time != now.log_time:
            return _whole(min(recorded, now, key=lambda one: one.log_time), *map(_at, (recorded, now)))
        if recorded.topic.name.endswith(f"/{TOPIC}"):
            self._aliases.learn(recorded, now)
        if recorded.payload == (payload := self._aliases.outwards(now.payload)):
            return None
        return _in_a_field(recorded, payload)


def _at(record: Recorded) -> str:
    return f"at {record.log_time / NANOSECONDS:.6f} s"


def _whole(record: Recorded, recorded: str, now: str) -> RunDifference:
    return RunDifference(record.log_time / NANOSECONDS, record.topic.name, "", recorded, now)


def _in_a_field(record: Recorded, payload: bytes) -> RunDifference:
    try:
        cls = registry.message(record.topic.type)
        pairs = zip(
            _leaves(to_plain(decode(cls, record.payload))), _leaves(to_plain(decode(cls, payload))), strict=False
        )
        field, before, after = next((one, a, b) for (one, a), (other, b) in pairs if (one, a) != (other, b))
    except (KeyError, CdrError, StopIteration):  # a type that is not installed, or bytes that belong to no field
        return _whole(record, f"{len(record.payload)} bytes", f"{len(payload)} other bytes")
    return RunDifference(record.log_time / NANOSECONDS, record.topic.name, field, f"{before}", f"{after}")


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield each value except maps and lists with its path, and the length of each list."""
    if isinstance(value, Mapping):
        for key, each in value.items():
            yield from _leaves(each, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list | tuple):
        yield f"{path} (length)", len(value)
        for index, each in enumerate(value):
            yield from _leaves(each, f"{path}[{index}]")
    else:
        yield path, value
