"""When times of day come: the words of cron, and clocks that are set twice a year."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.clock import universal_time
from rbxcompose.missions.triggers.trigger import DAYS, MONTHS, Local, Schedule, daily, instant_of, parse_cron
from tests.loops import for_all

BERLIN, LORD_HOWE = ZoneInfo("Europe/Berlin"), ZoneInfo("Australia/Lord_Howe")


def in_zone(zone: ZoneInfo) -> Local:
    return lambda seconds: datetime.fromtimestamp(seconds, zone).replace(tzinfo=None)


def at(text: str, zone: ZoneInfo | None = None) -> float:
    return datetime.fromisoformat(text).replace(tzinfo=zone or UTC).timestamp()


def coming(schedule: Schedule, after: str, count: int, zone: ZoneInfo | None = None) -> list[str]:
    local = in_zone(zone) if zone else universal_time
    found, last = [], at(after, zone)
    for _ in range(count):
        due = schedule.next(last, local)
        if due is None:
            break
        found.append(f"{local(due):%a %m-%d %H:%M}")
        last = due
    return found


@for_all(
    "words, expected",
    [
        ("0 22 * * mon,fri", ["Fri 11-27 22:00", "Mon 11-30 22:00", "Fri 12-04 22:00"]),
        ("*/20 9-10 * * *", ["Fri 11-27 09:00", "Fri 11-27 09:20", "Fri 11-27 09:40"]),
        ("5/25 8 * * *", ["Fri 11-27 08:05", "Fri 11-27 08:30", "Fri 11-27 08:55"]),
        ("0 6 1 jan,jul *", ["Fri 01-01 06:00", "Thu 07-01 06:00", "Sat 01-01 06:00"]),
        ("0 0 29 feb *", ["Tue 02-29 00:00", "Sun 02-29 00:00", "Fri 02-29 00:00"]),
        ("0 0 * * sat-sun", ["Sat 11-28 00:00", "Sun 11-29 00:00", "Sat 12-05 00:00"]),
        ("0 0 * * 0", ["Sun 11-29 00:00", "Sun 12-06 00:00", "Sun 12-13 00:00"]),
        ("0 0 * * 7", ["Sun 11-29 00:00", "Sun 12-06 00:00", "Sun 12-13 00:00"]),
        ("0 0 28 * sun", ["Sat 11-28 00:00", "Sun 11-29 00:00", "Sun 12-06 00:00"]),
        ("0 0 31 2 *", []),
    ],
)
def test_cron_words_mean_what_they_mean_in_cron(words: str, expected: list[str]) -> None:
    schedule = parse_cron(words)
    assert coming(schedule, "2026-11-27T00:00", 3) == expected
    assert schedule.comes is bool(expected)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("0 22 * *", "must have 5 fields .*, not 4"),
        ("60 * * * *", "has the minute 60: it goes from 0 to 59"),
        ("0 22 * * mo", "has the day of the week 'mo': it is a number from 0 to 7 or mon, tue"),
        ("0 5-3 * * *", "has a range of hours that ends before it begins: '5-3'"),
        ("*/0 * * * *", "has a step of minutes that is no whole number from 1"),
        ("0 0 0 * *", "has the day of the month 0: it goes from 1 to 31"),
        (", * * * *", "has the minute ''"),
    ],
)
def test_words_that_are_not_of_cron_are_refused_with_the_reason(words: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        parse_cron(words)


@pytest.mark.parametrize("text", ["22", "22:0", "24:00", "22:60", "-1:00", "ten"])
def test_what_is_no_time_of_day_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="time of day"):
        daily(text)


def test_a_time_that_clocks_skip_comes_when_they_are_set() -> None:
    assert coming(daily("02:30"), "2026-03-28T12:00", 2, BERLIN) == ["Sun 03-29 03:00", "Mon 03-30 02:30"]


def test_a_time_that_clocks_show_twice_comes_once() -> None:
    assert coming(daily("02:30"), "2026-10-24T12:00", 2, BERLIN) == ["Sun 10-25 02:30", "Mon 10-26 02:30"]
    first = daily("02:30").next(at("2026-10-24T12:00", BERLIN), in_zone(BERLIN))
    assert first == at("2026-10-25T00:30")  # still in summer time


@given(
    st.integers(at("2025-01-01T00:00").__trunc__(), at("2028-01-01T00:00").__trunc__()),
    st.sampled_from((BERLIN, LORD_HOWE, ZoneInfo("America/St_Johns"))),
)
def test_the_instant_of_a_moment_is_the_first_that_shows_it_or_more(seconds: int, zone: ZoneInfo) -> None:
    local = in_zone(zone)
    moment = local(seconds).replace(second=0)
    instant = instant_of(moment, local)
    assert local(instant) == moment
    assert instant <= seconds
    assert local(instant - 1) < moment


WORD: Callable[[int, int], st.SearchStrategy[str]] = lambda low, high: st.one_of(  # noqa: E731
    st.just("*"),
    st.integers(2, 20).map("*/{}".format),
    st.lists(st.integers(low, high).map(str), min_size=1, max_size=3).map(",".join),
)
CRON = st.tuples(
    WORD(0, 59), WORD(0, 23), WORD(1, 31), st.sampled_from(("*", *MONTHS)), st.sampled_from(("*", *DAYS))
).map(" ".join)


@given(CRON, st.integers(0, 366 * 24 * 60), st.sampled_from((BERLIN, LORD_HOWE)))
def test_the_next_time_is_the_next_minute_that_fits(words: str, minutes: int, zone: ZoneInfo) -> None:
    schedule, local = parse_cron(words), in_zone(zone)
    after = at("2026-01-01T00:00") + 60 * minutes
    due = schedule.next(after, local)
    last = after + timedelta(days=2).total_seconds()
    fits = (
        minute
        for minute in range(int(after) + 60, int(last), 60)
        if schedule.is_on(local(minute).date())
        and local(minute).hour in schedule.hours
        and local(minute).minute in schedule.minutes
        and instant_of(local(minute), local) == minute  # not the second time that clocks show it
    )
    first = next(fits, None)
    if first is not None and due is not None:
        assert due <= first
    if due is not None and due < last and due != first:
        assert local(due - 1) < local(due) - timedelta(seconds=1)  # clocks were set over the time itself


@given(CRON, CRON)
def test_schedules_meet_if_and_only_if_one_ever_comes_with_the_other(words: str, others: str) -> None:
    one, other = parse_cron(words), parse_cron(others)
    common = {*one.minutes} & {*other.minutes}
    assert one.meets(other) is other.meets(one)
    assert one.meets(one) is one.comes
    if not common:
        assert not one.meets(other)
