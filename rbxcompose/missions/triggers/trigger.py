"""A trigger as the executive has it: what starts which mission and when, what becomes of those that run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import field
from datetime import UTC, date, datetime, time, timedelta

from rbxcompose.base.dataclass import dataclass
from rbxcompose.missions.engine.world import Watched

Local = Callable[[float], datetime]
"""Returns what a wall clock shows, without a zone, at a time since the Unix epoch [s]."""

DAYS = ("mon", "tue", "wed", "thu", "fri", "sat", "sun")
MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_LEAP_YEAR = 2000
_MOST_DAYS = 366 * 9  # until 29 February comes again, also over a year such as 2100
_DAY = 86400
_SUNDAY = 7


@dataclass(frozen=True, slots=True)
class _Field:
    """One of the five fields: what it counts, its range, and the words for its numbers."""

    what: str
    first: int
    last: int
    words: Mapping[str, int]


_FIELDS = (
    _Field("minute", 0, 59, {}),
    _Field("hour", 0, 23, {}),
    _Field("day of the month", 1, 31, {}),
    _Field("month", 1, 12, {word: number for number, word in enumerate(MONTHS, 1)}),
    _Field("day of the week", 0, _SUNDAY, {word: number for number, word in enumerate(DAYS, 1)} | {"sun": 0}),
)


@dataclass(frozen=True, slots=True)
class Schedule:
    """Times of day on some days. `weekdays` counts from Monday, 0.

    As in cron, a day counts if it is one of `days` or of `weekdays`; None for one of the two leaves it to the other.
    """

    minutes: tuple[int, ...]
    hours: tuple[int, ...]
    days: frozenset[int] | None
    months: frozenset[int]
    weekdays: frozenset[int] | None

    @property
    def comes(self) -> bool:
        """Return whether there is such a day in any year."""
        from calendar import monthrange  # with locales, which few robots need

        longest = max(monthrange(_LEAP_YEAR, month)[1] for month in self.months)
        return self.days is None or self.weekdays is not None or min(self.days) <= longest

    def is_on(self, day: date) -> bool:
        """Return whether it comes on a day."""
        if day.month not in self.months:
            return False
        if self.days is None or self.weekdays is None:
            return (self.days is None or day.day in self.days) and (
                self.weekdays is None or day.weekday() in self.weekdays
            )
        return day.day in self.days or day.weekday() in self.weekdays

    def next(self, after: float, local: Local) -> float | None:
        """Return the first instant after `after` at which it comes [s since the Unix epoch]; None if it never does.

        A time of day that does not exist, because clocks are set forward, comes when they are set; of one that exists
        twice, the first counts. So each comes once.
        """
        for moment in self._moments(local(after)):
            if (instant := instant_of(moment, local)) > after:
                return instant
        return None

    def meets(self, other: Schedule) -> bool:
        """Return whether both ever come at the same minute."""
        if not ({*self.minutes} & {*other.minutes} and {*self.hours} & {*other.hours} and self.months & other.months):
            return False
        start = date(_LEAP_YEAR, 1, 1)
        days = (start + timedelta(days=number) for number in range(_MOST_DAYS))
        return any(self.is_on(day) and other.is_on(day) for day in days)

    def _moments(self, begin: datetime) -> Iterator[datetime]:
        """Yield the times on a wall clock at which it comes, from those of the day `begin`, without earlier ones."""
        earliest = begin.replace(second=0, microsecond=0)
        for number in range(_MOST_DAYS):
            day = begin.date() + timedelta(days=number)
            if self.is_on(day):
                moments = (datetime.combine(day, time(hour, minute)) for hour in self.hours for minute in self.minutes)
                yield from (moment for moment in moments if number or moment >= earliest)


def instant_of(moment: datetime, local: Local) -> float:
    """Return the first instant at which a wall clock shows `moment` or, if it leaves that out, more."""
    as_utc = _seconds(moment)
    shifts = [_shift(as_utc + days * _DAY, local) for days in (-1, 1)]  # clocks are set once within this time at most
    early, late = as_utc - max(shifts), as_utc - min(shifts)
    for instant in (early, late):
        if local(instant) == moment:
            return instant
    while late - early > 1:
        middle = (early + late) // 2
        early, late = (early, middle) if local(middle) >= moment else (middle, late)
    return late


def _shift(instant: int, local: Local) -> int:
    """Return by how much a wall clock is ahead of UTC [s]."""
    return _seconds(local(instant)) - instant


def _seconds(moment: datetime) -> int:
    """Return the instant at which a clock of UTC shows what a wall clock does, in whole seconds."""
    return int(moment.replace(microsecond=0, tzinfo=UTC).timestamp())


def daily(text: str, weekdays: tuple[str, ...] = ()) -> Schedule:
    """Return the schedule of a time such as `22:00` on some days of the week, every day without any.

    Raises:
        ValueError: if it is no time of day.
    """
    hour, _, minute = text.partition(":")
    if not (hour.isdecimal() and minute.isdecimal() and len(minute) == 2 and len(hour) <= 2):
        raise ValueError("must be a time of day such as '22:00'")
    if int(hour) > _FIELDS[1].last or int(minute) > _FIELDS[0].last:
        raise ValueError("must be a time of day from '00:00' to '23:59'")
    on = frozenset(map(DAYS.index, weekdays)) if weekdays else None
    return Schedule((int(minute),), (int(hour),), None, frozenset(range(1, 13)), on)


def parse_cron(text: str) -> Schedule:
    """Return the schedule of the five fields of cron: minute, hour, day of the month, month, day of the week.

    Raises:
        ValueError: if they are not that, with the reason.
    """
    words = text.split()
    if len(words) != len(_FIELDS):
        names = ", ".join(one.what for one in _FIELDS)
        raise ValueError(f"must have 5 fields ({names}), not {len(words)}")
    minutes, hours, days, months, weekdays = (
        _numbers(word.lower(), one) for word, one in zip(words, _FIELDS, strict=True)
    )
    on = frozenset((day - 1) % _SUNDAY for day in weekdays)
    any_day, any_weekday = (words[at] == "*" for at in (2, 4))
    days_, on_ = None if any_day else days, None if any_weekday else on
    return Schedule(tuple(sorted(minutes)), tuple(sorted(hours)), days_, months, on_)


def _numbers(text: str, one: _Field) -> frozenset[int]:
    return frozenset(number for item in text.split(",") for number in _item(item, one))


def _item(text: str, one: _Field) -> range:
    """Return the numbers of `*`, `5`, `mon`, `1-5`, or one of these with a step: `*/15`."""
    span, slash, step = text.partition("/")
    first, dash, last = span.partition("-")
    every = 1
    if slash:
        if not step.isdecimal() or not int(step):
            raise ValueError(f"has a step of {one.what}s that is no whole number from 1: '{text}'")
        every = int(step)
    if span == "*":
        return range(one.first, one.last + 1, every)
    low = _number(first, one)
    high = _number(last, one) if dash else one.last if slash else low
    if one.last == _SUNDAY and dash and high == 0:
        high = _SUNDAY  # 'fri-sun'
    if high < low:
        raise ValueError(f"has a range of {one.what}s that ends before it begins: '{span}'")
    return range(low, high + 1, every)


def _number(text: str, one: _Field) -> int:
    if text in one.words:
        return one.words[text]
    if not text.isdecimal():
        known = f" or {', '.join(one.words)}" if one.words else ""
        raise ValueError(f"has the {one.what} '{text}': it is a number from {one.first} to {one.last}{known}")
    if not one.first <= int(text) <= one.last:
        raise ValueError(f"has the {one.what} {text}: it goes from {one.first} to {one.last}")
    return int(text)


SKIP, QUEUE, INTERRUPT = "skip", "queue", "interrupt"
HALTED = "halted"


@dataclass(frozen=True, slots=True)
class Trigger:
    """Starts a mission, with inputs as text. Exactly one of the fields from `schedule` to `ends` is its cause.

    `cause` is that in words. `message` is the ROS type of the messages on `topic`. Without an `outcome`, every end of
    the mission `ends` counts that it comes to by itself. `running` is what happens if a mission is in the way.
    """

    name: str
    mission: str
    cause: str
    inputs: Mapping[str, str] = field(default_factory=dict)
    priority: int = 0
    running: str = SKIP
    schedule: Schedule | None = None
    when: Watched | None = None
    topic: str = ""
    message: str = ""
    at_start: bool = False
    ends: str = ""
    outcome: str = ""

    @property
    def reads(self) -> frozenset[str]:
        """Return the `$names` that its condition reads."""
        return self.when.names if self.when else frozenset()

    def follows(self, mission: str, ends: frozenset[str]) -> bool:
        """Return whether it is caused by an end of a mission; `ends` are the words for that end."""
        return (
            bool(self.ends) and self.ends == mission and (self.outcome in ends if self.outcome else HALTED not in ends)
        )
