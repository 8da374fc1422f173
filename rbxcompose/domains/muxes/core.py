"""Selects which of several command sources is let through, below latches and locks that no source can override.

A running mux alone needs this: `core_of` makes of a configuration what its mode and profile mean.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any, Generic, Protocol, TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.muxes.config import (
    HIGHEST,
    HoldFirst,
    MuxConfig,
    MuxEnding,
    MuxInputConfig,
    MuxLockConfig,
    MuxProfile,
    handover_limits,
)
from rbxcompose.domains.muxes.requests import NONE, MuxInputState, MuxLockState
from rbxcompose.msgs import registry
from rbxcompose.msgs.arrays import holds_numbers, zeros
from rbxcompose.msgs.definitions import FLOATS, INTEGERS, FieldShape, FieldType, attribute, parse_type
from rbxcompose.msgs.geometry_msgs import Twist, TwistStamped, Vector3
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.types import Message

M = TypeVar("M")

QUIET = 0.5  # [s] of silence after which an input without a timeout counts as come to rest
NEVER = math.inf
AXES = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class MuxSource:
    """A source that is expected to send repeatedly: after more than `timeout` [s] of silence it counts as gone."""

    priority: int = 0
    timeout: float = NEVER
    zero_releases: bool = False
    """Its zero lets go of the output at once, instead of holding it until the timeout."""
    starts_live: bool = False
    """It counts as live before its first message."""

    @property
    def quiet(self) -> float:
        """Return the silence [s] after which it is sure that it commands nothing any more."""
        return self.timeout if 0 < self.timeout < NEVER else QUIET


@dataclass(frozen=True, slots=True)
class LockSource:
    """A lock that holds back every input with a lower priority.

    It carries a heartbeat, and is engaged while it is silent; or a flag, and is engaged while that is true, or silent
    for longer than the timeout, if it has one.
    """

    priority: float = NEVER
    timeout: float = NEVER
    is_flag: bool = False


class Ramp(Protocol[M]):
    """Bounds how fast the output changes from what one source commanded to what the next one commands."""

    def limit(self, linear: float, angular: float) -> None:
        """Have other limits from now on [m/s^2, rad/s^2]."""
        ...

    def begin(self, last: M, now: float) -> None:
        """Begin at `last`, which came out before another source took over."""
        ...

    def through(self, message: M, now: float) -> M:
        """Return what comes out for a message of the new source."""
        ...

    def end(self) -> None:
        """Let everything through as it is."""
        ...


@dataclass(frozen=True, slots=True)
class MuxEndings:
    """How long after the last command a stop follows [s]; `NEVER` for none."""

    on_idle: float = 0.0
    """When its source has fallen silent and no other is live."""
    on_lock: float = 0.0
    """When its source was locked out."""


def zeroed(message: Message) -> Message:
    """Return a message of the same shape whose numbers are zero; headers, flags and texts stay."""
    changed = {name: _zero(value) for name, value in _numbers(message)}
    return replace(message, **changed)  # type: ignore[type-var]


def is_zeroed(message: Message) -> bool:
    """Return whether all numbers of a message are zero."""
    return all(_is_zero(value) for _, value in _numbers(message))


def rest_of(message: type[Message]) -> Callable[[Message | None], Message]:
    """Return what makes the message of rest from the last one that came through, or from none."""
    empty = message()
    return lambda last: empty if last is None else zeroed(last)


def _numbers(message: Message) -> Iterator[tuple[str, Any]]:
    kind: Any = type(message)  # mypy considers classes of a generic not hashable
    for name in _names(kind):
        yield name, getattr(message, name)


@cache
def _names(message: type[Message]) -> tuple[str, ...]:
    """Return the fields with numbers: numbers, arrays of them, messages, rows of messages."""
    return tuple(attribute(name) for name, text in message.FIELDS.items() if _has_numbers(parse_type(text)))


def _has_numbers(type_: FieldType) -> bool:
    is_number = type_.base in (*FLOATS, *INTEGERS)
    is_plain = is_number and (type_.shape is FieldShape.SINGLE or holds_numbers(type_))
    return is_plain or (type_.is_message and type_.base != Header.TYPE)


def _zero(value: Any) -> Any:
    if isinstance(value, Message):
        return zeroed(value)
    if isinstance(value, tuple | list):
        return tuple(map(zeroed, value))
    return zeros(value.dtype.name, value.size) if hasattr(value, "dtype") else type(value)(0)


def _is_zero(value: Any) -> bool:
    if isinstance(value, Message):
        return is_zeroed(value)
    if isinstance(value, tuple | list):
        return all(map(is_zeroed, value))
    return not (value.any() if hasattr(value, "dtype") else value)


class MuxLocks:
    """Which inputs are held back, and by what. All times are robot time [s]."""

    def __init__(self, locks: Mapping[str, LockSource]) -> None:
        self.declared = dict(locks)
        self.by_hand: dict[str, float] = {}  # until when, by input
        self._until: dict[str, float] = {}  # when a lock engages because it is silent
        self._is_on = dict.fromkeys(locks, False)
        self.forget()

    def __bool__(self) -> bool:
        return bool(self.declared or self.by_hand)

    def take_over(self, old: MuxLocks, inputs: Mapping[str, MuxSource]) -> None:
        """Copy what is known of locks with the same names, and what was locked by hand."""
        self._until |= {name: until for name, until in old._until.items() if name in self.declared}
        self._is_on |= {name: is_on for name, is_on in old._is_on.items() if name in self.declared}
        self.by_hand |= {name: until for name, until in old.by_hand.items() if name in inputs}

    def received(self, name: str, now: float, *, is_on: bool) -> None:
        """Receive a heartbeat, or a flag.

        Raises:
            KeyError: if there is no such lock.
        """
        self._until[name] = now + self.declared[name].timeout
        self._is_on[name] = is_on

    def forget(self) -> None:
        """Take all heartbeats for silent; a flag keeps its last value, and one with a timeout must be heard again."""
        self._until = {
            name: math.inf if lock.is_flag and lock.timeout == math.inf else -math.inf
            for name, lock in self.declared.items()
        }

    def expire(self, now: float) -> list[str]:
        """End what was locked by hand up to now; return these inputs."""
        ended = [name for name, until in self.by_hand.items() if until <= now]
        for name in ended:
            del self.by_hand[name]
        return ended

    def ends(self) -> Iterator[float]:
        """Yield the moments at which a lock engages by silence, or one made by hand ends."""
        yield from (math.nextafter(until, math.inf) for until in self._until.values() if until < math.inf)
        yield from (until for until in self.by_hand.values() if until < math.inf)

    def locked(self, inputs: Mapping[str, MuxSource], now: float) -> list[str]:
        """Return the inputs that are held back."""
        if not self:  # as in most muxes, at each message
            return []
        floor = max((self.declared[name].priority for name in self.engaged(now)), default=-math.inf)
        return [name for name, source in inputs.items() if source.priority < floor or name in self.by_hand]

    def engaged(self, now: float) -> list[str]:
        """Return the locks that hold back what is below them."""
        return [name for name in self.declared if self._is_on[name] or now > self._until[name]]

    def why(self, name: str, now: float) -> str:
        """Return why a lock is engaged, with the silence that counts; empty if it is not."""
        if self._is_on[name]:
            return f"{name} is on"
        what = "does not report" if self.declared[name].is_flag else "gives no heartbeat"
        return f"{name} {what}" if now > self._until[name] else ""

    def above(self, source: MuxSource, now: float) -> list[str]:
        """Return the engaged locks that hold back a source."""
        return [name for name in self.engaged(now) if source.priority < self.declared[name].priority]


Sources = Mapping[str, MuxSource]


class Arbiter(ABC):
    """Chooses the input that is let through."""

    selected: str | None = None
    """The input that somebody has chosen."""

    @abstractmethod
    def holder(self, free: Sequence[str], sources: Sources) -> str | None:
        """Return which of the free inputs, in their written order, is let through."""

    def received(self, name: str, free: Sequence[str], sources: Sources) -> None:  # noqa: B027 - most do not care
        """Note that an input has sent a message, and is now among the free ones or not."""

    @abstractmethod
    def passed_over(self, name: str, holder: str, sources: Sources) -> str:
        """Return why a free input is not let through beside the holder."""

    def take_over(self, old: Arbiter, names: Sequence[str]) -> None:
        """Continue with what `old` had chosen, as far as it is among these names."""
        if type(old) is type(self) and old.selected in names:
            self.selected = old.selected


class ByPriority(Arbiter):
    """The highest priority; of equal ones the first in the list."""

    def holder(self, free: Sequence[str], sources: Sources) -> str | None:
        """Return the free input with the highest priority."""
        return max(free, key=lambda name: sources[name].priority, default=None)

    def passed_over(self, name: str, holder: str, sources: Sources) -> str:
        """Return which priority is higher."""
        is_equal = sources[name].priority == sources[holder].priority
        return f"'{holder}' has the same priority and comes first" if is_equal else f"'{holder}' has a higher priority"


class AsTwistMux(ByPriority):
    """The rule of `twist_mux`: priorities go from 0 to 255, and 0 never passes."""

    def holder(self, free: Sequence[str], sources: Sources) -> str | None:
        """Return the free input with the highest priority above 0."""
        return super().holder([name for name in free if sources[name].priority > 0], sources)

    def passed_over(self, name: str, holder: str, sources: Sources) -> str:
        """Return which priority is higher."""
        never = "priority 0 never passes in this profile"
        return super().passed_over(name, holder, sources) if sources[name].priority > 0 else never


class AsYocs(Arbiter):
    """The rule of `yocs_cmd_vel_mux`: who holds keeps the output until its own timeout or a higher priority.

    After the timeout nobody holds, and the first message of any input gets through.
    """

    def __init__(self) -> None:
        self._allowed: str | None = None

    def received(self, name: str, free: Sequence[str], sources: Sources) -> None:
        """Let a sender take the output if it is vacant, or held by one of a lower priority."""
        holder = self.holder(free, sources)
        if name in free and (holder is None or sources[name].priority > sources[holder].priority):
            self._allowed = name

    def holder(self, free: Sequence[str], sources: Sources) -> str | None:
        """Return who holds it, until its timeout."""
        if self._allowed not in free:
            self._allowed = None
        return self._allowed

    def passed_over(self, name: str, holder: str, sources: Sources) -> str:
        """Return who must fall silent first."""
        return f"'{holder}' keeps it until it falls silent"

    def take_over(self, old: Arbiter, names: Sequence[str]) -> None:
        """Continue with the same holder."""
        if isinstance(old, AsYocs) and old._allowed in names:
            self._allowed = old._allowed


class BySelection(Arbiter):
    """The one that somebody has selected, whatever the others send; nobody takes over when it falls silent."""

    def __init__(self, selected: str | None) -> None:
        self.selected = selected

    def holder(self, free: Sequence[str], sources: Sources) -> str | None:
        """Return the selected input if it is free."""
        return self.selected if self.selected in free else None

    def passed_over(self, name: str, holder: str, sources: Sources) -> str:
        """Return which one is selected."""
        return f"'{holder}' is selected"

    def take_over(self, old: Arbiter, names: Sequence[str]) -> None:
        """Continue with the same selection, also with that of none."""
        if isinstance(old, BySelection) and (old.selected is None or old.selected in names):
            self.selected = old.selected


class ByLatest(Arbiter):
    """Whoever sent last, among those that are still live."""

    def __init__(self) -> None:
        self._order: list[str] = []  # of the last messages; the newest is at the end

    def received(self, name: str, free: Sequence[str], sources: Sources) -> None:
        """Note the newest sender."""
        if name in self._order:
            self._order.remove(name)
        self._order.append(name)

    def holder(self, free: Sequence[str], sources: Sources) -> str | None:
        """Return the newest sender that is free."""
        return next((name for name in reversed(self._order) if name in free), None)

    def passed_over(self, name: str, holder: str, sources: Sources) -> str:
        """Return who sent later."""
        return f"'{holder}' sent later"

    def take_over(self, old: Arbiter, names: Sequence[str]) -> None:
        """Continue with the same order."""
        if isinstance(old, ByLatest):
            self._order = [name for name in old._order if name in names]


def grown(last: float, wanted: float, most: float) -> float:
    """Return the next value on the way from `last` to `wanted`: it may grow by `most`, and shrink at once.

    What goes the other way is brought to 0 first. So nothing is ever faster than the new source wants it.
    """
    start = last if last * wanted > 0 else 0.0
    return math.copysign(min(abs(wanted), abs(start) + most), wanted)


class TwistRamp:
    """Bounds the growth [m/s^2, rad/s^2] of velocities after a hand-over, until they are what the new source commands.

    A smaller command, and so a stop, is never delayed.
    """

    def __init__(self, linear: float = math.inf, angular: float = math.inf) -> None:
        self._linear, self._angular = linear, angular
        self._last: tuple[Twist, float] | None = None  # what came out last, and when; None if nothing is bounded

    def limit(self, linear: float, angular: float) -> None:
        """Have other limits from now on."""
        self._linear, self._angular = linear, angular

    def begin(self, last: Twist, now: float) -> None:
        """Begin at the velocity that came out last."""
        self._last = last, now

    def through(self, message: Twist, now: float) -> Twist:
        """Return the velocity that comes out for a command."""
        if self._last is None:
            return message
        last, then = self._last
        linear = _limited(last.linear, message.linear, self._linear, now - then)
        angular = _limited(last.angular, message.angular, self._angular, now - then)
        if linear == message.linear and angular == message.angular:
            self._last = None
            return message
        out = Twist(linear=linear, angular=angular)
        self._last = out, now
        return out

    def end(self) -> None:
        """Bound nothing any more."""
        self._last = None


class StampedTwistRamp:
    """The same for velocities with a stamp; what comes out has the stamp of the command."""

    def __init__(self, linear: float = math.inf, angular: float = math.inf) -> None:
        self._ramp = TwistRamp(linear, angular)

    def limit(self, linear: float, angular: float) -> None:
        """Have other limits from now on."""
        self._ramp.limit(linear, angular)

    def begin(self, last: TwistStamped, now: float) -> None:
        """Begin at the velocity that came out last."""
        self._ramp.begin(last.twist, now)

    def through(self, message: TwistStamped, now: float) -> TwistStamped:
        """Return the velocity that comes out for a command."""
        return replace(message, twist=self._ramp.through(message.twist, now))

    def end(self) -> None:
        """Bound nothing any more."""
        self._ramp.end()


RAMPS: dict[str, Callable[[float, float], Ramp[Any]]] = {Twist.TYPE: TwistRamp, TwistStamped.TYPE: StampedTwistRamp}
"""By the name of the message type; there is none for other types."""


def _limited(last: Vector3, wanted: Vector3, acceleration: float, time: float) -> Vector3:
    most = acceleration * time if acceleration < math.inf else math.inf
    return Vector3(**{axis: grown(getattr(last, axis), getattr(wanted, axis), most) for axis in AXES})


def _never(message: object) -> bool:
    return False


class MuxCore(Generic[M]):
    """Lets one input through, with the latched lock `stop` above all of them.

    `zero` makes the message that commands rest from the last one that came out, or from None. It is None itself for
    messages that have no rest: then the mux sends none of its own. `stopped` is for a mux that was stopped when its
    process died.
    """

    def __init__(
        self,
        inputs: Mapping[str, MuxSource],
        *,
        zero: Callable[[M | None], M] | None,
        is_zero: Callable[[M], bool] = _never,
        arbiter: Arbiter | None = None,
        locks: Mapping[str, LockSource] | None = None,
        endings: MuxEndings | None = None,
        handover: Ramp[M] | None = None,
        stopped: bool = False,
    ) -> None:
        self.inputs: dict[str, MuxSource] = {}
        self.locks = MuxLocks(locks or {})
        self.arbiter = arbiter or ByPriority()
        self.is_stopped, self.is_closed, self.is_held = stopped, False, False
        self.waiting: set[str] = set()  # inputs that must come to rest once before they count again
        self.sending_until: dict[str, float] = {}  # when an input is sure to be quiet
        self._zero, self._is_zero, self._endings, self._handover = zero, is_zero, endings or MuxEndings(), handover
        self._shape: M | None = None  # the last message that came out
        self._live_until: dict[str, float] = {}  # last moment at which an input is live
        self._neutral: set[str] = set()  # inputs whose last message was zero
        self._active: str | None = None
        self._last: tuple[str, M] | None = None  # whose message came out last; None after a zero of our own
        self._stop_at: float | None = None  # when the stop follows the end of the last source
        self._now = -math.inf
        for name, source in inputs.items():
            self.inputs[name] = source
            self._forget(name)
        if stopped:  # who was sending before a restart is unknown, so all count as sending
            self.sending_until = dict.fromkeys(self.inputs, math.inf)

    def take_over(self, old: MuxCore[M]) -> None:
        """Copy when inputs and locks of the same names were last received, what was chosen, and who must rest once."""
        for mine, theirs in ((self._live_until, old._live_until), (self.sending_until, old.sending_until)):
            mine |= {name: until for name, until in theirs.items() if name in self.inputs}
        self.locks.take_over(old.locks, self.inputs)
        self.arbiter.take_over(old.arbiter, list(self.inputs))
        self._neutral = old._neutral & self.inputs.keys()
        self.waiting = old.waiting & self.inputs.keys()

    @property
    def active(self) -> str | None:
        """The input let through as of the last call; None if there is none."""
        return self._active

    # What arrives

    def receive(self, name: str, message: M, now: float) -> M | None:
        """Receive a message of input `name`; return what must be forwarded, None for nothing.

        Raises:
            KeyError: if there is no such input.
        """
        source = self.inputs[name]
        self._settle(now)
        is_zero, was_quiet = self._is_zero(message), now > self.sending_until[name]
        self._neutral.discard(name)
        if is_zero:
            self._neutral.add(name)
        if was_quiet or is_zero:
            self.waiting.discard(name)
        self.sending_until[name] = now + source.quiet
        if is_zero and source.zero_releases:
            return self._let_go(name, message, now)
        self._live_until[name] = now + source.timeout
        self.arbiter.received(name, self._free(now), self.inputs)
        self._settle(now)
        return self._passed(name, message, now) if self._active == name else None

    def _let_go(self, name: str, message: M, now: float) -> M | None:
        """Return the zero of an input that lets go, if it held the output: it stops by itself what it has begun."""
        held = self._active == name
        self._live_until[name] = -math.inf
        if held:
            self._rests()
        self._settle(now)
        return message if held else None

    def _passed(self, name: str, message: M, now: float) -> M:
        if self._handover is not None:
            if self._last is not None and self._last[0] != name:
                self._handover.begin(self._last[1], now)
            message = self._handover.through(message, now)
        self._last, self._shape = (name, message), message
        return message

    def bound(self, linear: float, angular: float) -> None:
        """Bound hand-overs, also one that goes on, by other limits."""
        if self._handover is not None:
            self._handover.limit(linear, angular)

    def heartbeat(self, lock: str, now: float) -> None:
        """Receive a heartbeat of `lock`: it blocks nothing until it has been silent for its timeout."""
        self.locks.received(lock, now, is_on=False)
        self._settle(now)

    def flag(self, lock: str, is_on: bool, now: float) -> None:
        """Receive a flag of `lock`: it blocks while it is true."""
        self.locks.received(lock, now, is_on=is_on)
        self._settle(now)

    # Time

    def tick(self, now: float) -> M | None:
        """Return a zero, once, when the source that was let through has ended, nobody follows it, and it is due."""
        self._settle(now)
        if self._stop_at is None or now < self._stop_at:
            return None
        return self._rests()

    def next_deadline(self) -> float | None:
        """Return when `tick` must be called if nothing is received before [s]; None if never.

        It is the first moment after a timeout: exactly at its timeout a source still counts as live.
        """
        ends: list[float] = list(self.locks.ends()) if not self.is_closed else []
        if not self._is_shut:
            waits = (self.sending_until[name] for name in self.waiting)
            ends += [math.nextafter(end, math.inf) for end in (*self._live_until.values(), *waits) if end < math.inf]
        due = [end for end in ends if self._now < end]
        return min([*due, self._stop_at] if self._stop_at is not None else due, default=None)

    # What people order

    def stop(self, now: float) -> M | None:
        """Latch the lock `stop`; return the zero to send immediately."""
        self.is_stopped = True
        return self._shut(now)

    def release(self, now: float) -> None:
        """Open the lock `stop`. This moves nothing: an input that still commands motion must come to rest once.

        To do that, its last message must be zero, or it must be silent for its timeout.
        """
        if self.is_stopped:
            self.is_stopped = False
            self._must_rest(self.inputs, now)
        self._settle(now)

    def rest(self, names: Iterable[str], now: float) -> None:
        """Have inputs come to rest once, also those of which nothing has been heard yet."""
        known = self.inputs.keys() & names
        self.sending_until |= dict.fromkeys(known, math.inf)
        self._must_rest(known, now)
        self._settle(now)

    def hold(self, now: float) -> M | None:
        """Let nothing through until `resume`; return the zero to send immediately."""
        self.is_held = True
        return self._shut(now)

    def resume(self, now: float) -> None:
        """Let new messages through again: inputs and heartbeats received before count as silent.

        An input that had to come to rest once still has to.
        """
        self.is_held = False
        for name in self.inputs.keys() - self.waiting:
            self._forget(name)
        self.locks.forget()
        self._settle(now)

    def close(self, now: float) -> M | None:
        """Shut down: return one last zero, after which neither `receive` nor `tick` returns a message."""
        self.is_closed = True
        return self._shut(now)

    def select(self, name: str | None, now: float) -> None:
        """Let this input through, or none, in a mux whose inputs are selected."""
        self.arbiter.selected = name
        self._settle(now)

    def lock(self, names: Iterable[str], until: float, now: float) -> None:
        """Hold these inputs back by hand until a time [s], which may be `NEVER`."""
        self.locks.by_hand |= dict.fromkeys(names, until)
        self._settle(now)

    def unlock(self, names: Iterable[str], now: float) -> None:
        """End what was locked by hand: an input goes on at once, as with other locks."""
        for name in names:
            self.locks.by_hand.pop(name, None)
        self._settle(now)

    def add(self, name: str, source: MuxSource, now: float) -> None:
        """Add an input."""
        self.inputs[name] = source
        self._forget(name)
        self._settle(now)

    def delete(self, name: str, now: float) -> None:
        """Remove an input; if it held the output, this is its end."""
        del self.inputs[name], self._live_until[name], self.sending_until[name]
        self.locks.by_hand.pop(name, None)
        self.waiting.discard(name)
        self._settle(now)

    # What is known

    def live_until(self, name: str) -> float:
        """Return the last moment at which an input is live [s], unless it sends again."""
        return self._live_until[name]

    def is_live(self, name: str, now: float) -> bool:
        """Return whether an input counts, or would if it were let."""
        return now <= self._live_until[name]

    def locked_out(self, now: float) -> list[str]:
        """Return the inputs that are locked; none while the mux is stopped or held.

        Shutting down does not cure a lock, so a closed mux still reports them.
        """
        return [] if self.is_stopped or self.is_held else self._locked(now)

    def refused(self, now: float) -> list[str]:
        """Return the inputs that are locked but still sending."""
        locked = [] if self.is_closed else self.locked_out(now)
        return [name for name in locked if self._would_count(name, now)]

    # How it decides

    def _settle(self, now: float) -> None:
        self._now = now
        self._must_rest(self.locks.expire(now), now)
        self._active = None if self._is_shut else self.arbiter.holder(self._free(now), self.inputs)
        if self._last is None or self._is_followed(self._last[0], now):
            self._stop_at = None
        elif self._stop_at is None:
            self._ended(now)

    def _is_followed(self, last: str, now: float) -> bool:
        """Return whether somebody commands still: who sent last, or a holder that sends, too."""
        return self._active is not None and (self._active == last or now <= self.sending_until[self._active])

    def _ended(self, now: float) -> None:
        """Note when the stop is due, now that the last source has ended."""
        is_locked = any(self._would_count(name, now) for name in self._locked(now))
        wait = self._endings.on_lock if is_locked else self._endings.on_idle
        if self._zero is None or wait == math.inf:
            self._rests()
        else:
            self._stop_at = now + wait

    def _rests(self) -> M | None:
        """Note that nothing is left in force of what came out; return the message of rest."""
        self._last = self._stop_at = None
        if self._handover is not None:
            self._handover.end()
        return self._zero(self._shape) if self._zero is not None else None

    def _shut(self, now: float) -> M | None:
        rest = self._rests()
        self._settle(now)
        return rest

    def _must_rest(self, names: Iterable[str], now: float) -> None:
        """Have inputs that still command motion come to rest once before they count again."""
        for name in names:
            if self.sending_until[name] >= now and name not in self._neutral:
                self.waiting.add(name)
                self.sending_until[name] = min(self.sending_until[name], now + self.inputs[name].quiet)

    def _forget(self, name: str) -> None:
        self._live_until[name] = math.inf if self.inputs[name].starts_live else -math.inf
        self.sending_until[name] = -math.inf

    def _free(self, now: float) -> list[str]:
        if self._is_shut:
            return []
        locked = self._locked(now)
        return [name for name in self.inputs if name not in locked and self._would_count(name, now)]

    def _would_count(self, name: str, now: float) -> bool:
        return name not in self.waiting and now <= self._live_until[name]

    def _locked(self, now: float) -> list[str]:
        return self.locks.locked(self.inputs, now)

    @property
    def _is_shut(self) -> bool:
        return self.is_stopped or self.is_closed or self.is_held


def core_of(config: MuxConfig, *, is_stopped: bool = False) -> MuxCore[Message]:
    """Return the core of a mux."""
    message = registry.message(config.message)
    rest: dict[str, Any] = {"zero": rest_of(message), "is_zero": is_zeroed} if config.has_rest else {"zero": None}
    return MuxCore(
        {name: source_of(input_config, config) for name, input_config in config.inputs.items()},
        arbiter=arbiter_of(config),
        locks={name: _lock(lock, config) for name, lock in config.locks.items()},
        endings=MuxEndings(_wait(config.on_idle, config.profile), _wait(config.on_lock, config.profile)),
        handover=_ramp(config),
        stopped=is_stopped,
        **rest,
    )


def arbiter_of(config: MuxConfig) -> Arbiter:
    """Return the rule by which the output is given."""
    if config.mode == "select":
        first = next(iter(config.inputs), None)
        return BySelection(first if config.initial is None else None if config.initial == NONE else config.initial)
    if config.mode == "latest":
        return ByLatest()
    made: Mapping[MuxProfile, Callable[[], Arbiter]] = {"twist_mux": AsTwistMux, "yocs": AsYocs}
    return made.get(config.profile, ByPriority)()


def source_of(input_config: MuxInputConfig, config: MuxConfig) -> MuxSource:
    """Return an input as the core knows it.

    In `twist_mux` an input with the timeout 0 never expires, and masks others before its first message. What is
    selected by hand needs no timeout: it is live as long as it is selected.
    """
    never_ends = input_config.timeout is None or (input_config.timeout == 0 and config.profile == "twist_mux")
    starts_live = never_ends and (config.mode == "select" or config.profile == "twist_mux")
    return MuxSource(
        _priority(input_config.priority, config) if config.has_priorities else 0,
        NEVER if never_ends or input_config.timeout is None else input_config.timeout,
        input_config.zero_releases and config.has_rest,
        starts_live,
    )


def _lock(lock_config: MuxLockConfig, config: MuxConfig) -> LockSource:
    counts = config.has_priorities and lock_config.priority is not None
    return LockSource(
        _priority(lock_config.priority or 0, config) if counts else NEVER,
        lock_config.timeout or NEVER,
        is_flag=bool(lock_config.topic),
    )


def _priority(written: int, config: MuxConfig) -> int:
    return max(0, min(written, HIGHEST)) if config.profile == "twist_mux" else written


def _wait(ending: MuxEnding | None, profile: MuxProfile) -> float:
    """Return how long after the last command the stop follows [s]."""
    match ending:
        case HoldFirst(hold=time):
            return time
        case None:
            return 0.0 if profile == "default" else NEVER
        case _:
            return 0.0 if ending == "stop" else NEVER


def _ramp(config: MuxConfig) -> Ramp[Any] | None:
    made = RAMPS.get(config.message)
    return None if made is None or config.handover is None else made(*handover_limits(config.handover))


class MuxAccount:
    """Tells what a core does at a robot time [s]."""

    def __init__(self, core: MuxCore[Any]) -> None:
        self._core = core

    def why(self, now: float) -> str:
        """Return a sentence for people on what controls the output.

        It has no times: each message of a source would make them wrong, and no status is worth sending that often.
        """
        if (shut := self._shut()) or not self._core.inputs:
            return shut or "no input"
        parts = [self._who_holds(now), *self._who_locks(now)]
        return "; ".join(filter(None, parts)) or self._nobody()

    def state_of(self, name: str, now: float) -> tuple[str, str]:
        """Return the state of an input in a word and, in more words, why; empty if there is nothing to add."""
        core = self._core
        if name == core.active:
            return "holds", ""
        if shut := self._shut():
            return "waits", shut
        if (until := core.locks.by_hand.get(name)) is not None:
            return "locked", "by hand" if until == math.inf else f"by hand, for another {max(until - now, 0.0):.1f} s"
        if above := core.locks.above(core.inputs[name], now):
            return "locked", _listed([core.locks.why(lock, now) for lock in above])
        if name in core.waiting:
            return "must rest", "it must come to rest once"
        if not core.is_live(name, now):
            return "silent", ""
        holder = core.active
        return "waits", core.arbiter.passed_over(name, holder, core.inputs) if holder else "it is not selected"

    def inputs(
        self, topics: Mapping[str, str], received_at: Mapping[str, float], now: float, *, has_priorities: bool
    ) -> tuple[MuxInputState, ...]:
        """Return all inputs; `received_at` has the time of the last message of each."""
        core = self._core
        return tuple(
            MuxInputState(
                name,
                topics[name],
                input_.priority if has_priorities else None,
                *self.state_of(name, now),
                _finite(core.live_until(name)) if core.is_live(name, now) else None,
                now - received_at[name] if name in received_at else None,
            )
            for name, input_ in core.inputs.items()
        )

    def locks(self, topics: Mapping[str, str], now: float) -> tuple[MuxLockState, ...]:
        """Return all locks."""
        locks = self._core.locks
        return tuple(
            MuxLockState(
                name, topics[name], int(entry.priority) if entry.priority < math.inf else None, locks.why(name, now)
            )
            for name, entry in locks.declared.items()
        )

    def _shut(self) -> str:
        if self._core.is_closed:
            return "closed: the robot is going down"
        if self._core.is_stopped:
            return "stopped"
        return "held: robot time stands still" if self._core.is_held else ""

    def _nobody(self) -> str:
        selected = self._core.arbiter.selected
        return f"{selected} is selected, and silent" if selected in self._core.inputs else "no input"

    def _who_holds(self, now: float) -> str:
        core = self._core
        if core.active is not None:
            return f"{core.active} holds"
        resting = [name for name in core.inputs if name in core.waiting and now <= core.sending_until[name]]
        return f"{_listed(resting)} must come to rest once" if resting else ""

    def _who_locks(self, now: float) -> list[str]:
        core, parts = self._core, list[str]()
        if not core.locks:
            return parts
        if hand := [name for name in core.locked_out(now) if name in core.locks.by_hand]:
            parts.append(f"{_listed(hand)} {_are(hand)} locked by hand")
        if out := [name for name in core.locked_out(now) if core.locks.above(core.inputs[name], now)]:
            reasons = [core.locks.why(name, now) for name in core.locks.engaged(now)]
            parts.append(f"{_listed(reasons)}: {_listed(out)} {_are(out)} locked out")
        return parts


def _listed(names: Sequence[str]) -> str:
    return " and ".join(names)


def _are(names: Sequence[str]) -> str:
    return "is" if len(names) == 1 else "are"


def _finite(time: float) -> float | None:
    return time if time < math.inf else None
