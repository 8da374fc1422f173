"""What triggers decide, over weeks of virtual time: once for each time, by priority, and nothing after a stop."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.clock import universal_time
from rbxcompose.missions.triggers.core import CHECK, Triggers
from rbxcompose.missions.triggers.trigger import INTERRUPT, QUEUE, SKIP, Trigger, daily, parse_cron

HOUR, DAY = 3600.0, 86400.0
MONDAY = datetime(2026, 11, 23, tzinfo=UTC).timestamp()


class Stage:
    """Missions that all need the same part of the robot, except those named `free...`; time as a test lets it pass."""

    def __init__(self, *triggers: Trigger, wall: float = MONDAY) -> None:
        self.core = Triggers({one.name: one for one in triggers}, universal_time)
        self.now, self.wall = 0.0, wall
        self.running: list[str] = []
        self.told: list[str] = []
        self.started: list[tuple[float, str]] = []  # wall-clock time, trigger
        self.refusal = ""
        self.look()

    def in_the_way(self, mission: str, /) -> Sequence[str]:
        clashing = [one for one in self.running if not (one.startswith("free") or mission.startswith("free"))]
        return list(dict.fromkeys([*([mission] if mission in self.running else []), *clashing]))

    def begin(self, trigger: Trigger, /) -> str:
        assert not self.core.is_stopped
        assert self.in_the_way(trigger.mission) == []
        if self.refusal:
            return self.refusal
        self.running.append(trigger.mission)
        self.started.append((self.wall, trigger.name))
        self.told.append(f"{trigger.name} starts {trigger.mission}")
        return ""

    def cancel(self, mission: str, trigger: Trigger, /) -> None:
        self.told.append(f"{trigger.name} cancels {mission}")
        self.end(mission, "halted", turns=False)

    def leave_out(self, trigger: Trigger, why: str, /) -> None:
        self.told.append(f"{trigger.name}: {why}")

    def wait(self, trigger: Trigger, missions: Sequence[str], /) -> None:
        self.told.append(f"{trigger.name} waits for {', '.join(missions)}")

    def end(self, mission: str, result: str = "success", *, turns: bool = True) -> None:
        self.running.remove(mission)
        self.core.ended(mission, frozenset({result}), self.now, self)
        if turns:
            self.core.turn(self.wall, self)

    def look(self) -> None:
        self.core.look_at_clock(self.now, self.wall, self)
        self.core.turn(self.wall, self)

    def advance(self, seconds: float, *, ends_all: bool = False) -> None:
        """Let time pass, look at the clock as often as is asked for; missions may end at once."""
        end = self.now + seconds
        while (due := self.core.next_look(self.now, self.wall)) is not None and due <= end:
            self.wall += due - self.now
            self.now = due
            self.look()
            for name in [*self.running] if ends_all else ():
                self.end(name)
        self.wall += end - self.now
        self.now = end

    def message(self, *names: str) -> None:
        self.now, self.wall = self.now + 2.0, self.wall + 2.0
        for name in names:
            self.core.message(name, self.now, self)
        self.core.turn(self.wall, self)

    @property
    def days(self) -> list[str]:
        return [f"{universal_time(wall):%a %H:%M} {name}" for wall, name in self.started]


def on_message(name: str, mission: str = "", *, priority: int = 0, running: str = SKIP) -> Trigger:
    return Trigger(name, mission or name, "message", priority=priority, running=running, topic=name)


NIGHTLY = Trigger("nightly", "clean", "at 22:00", schedule=daily("22:00", ("mon", "fri")))


def test_two_weeks_have_four_evenings() -> None:
    stage = Stage(NIGHTLY)
    stage.advance(14 * DAY, ends_all=True)
    assert stage.days == ["Mon 22:00 nightly", "Fri 22:00 nightly"] * 2


def test_a_robot_that_was_down_at_that_time_does_not_start_late() -> None:
    stage = Stage(NIGHTLY, wall=MONDAY + 22 * HOUR + 300.0)
    stage.advance(3 * DAY)
    assert stage.started == []


def test_a_robot_that_slept_over_it_does_not_start_late() -> None:
    stage = Stage(NIGHTLY)
    stage.advance(21 * HOUR)
    stage.now, stage.wall = stage.now + 1.1 * HOUR, stage.wall + 1.1 * HOUR  # nobody looked meanwhile
    stage.look()
    assert stage.started == []


def test_a_clock_that_is_set_forward_over_it_starts_nothing() -> None:
    stage = Stage(NIGHTLY)
    stage.advance(21 * HOUR)
    stage.wall += 1.5 * HOUR
    stage.advance(HOUR)
    assert stage.started == []


def test_a_clock_that_is_set_back_does_not_start_it_again() -> None:
    stage = Stage(NIGHTLY)
    stage.advance(22.25 * HOUR, ends_all=True)
    stage.wall -= HOUR
    stage.advance(2 * HOUR, ends_all=True)
    assert stage.days == ["Mon 22:00 nightly"]


@given(
    st.lists(
        st.one_of(
            st.tuples(st.just("passes"), st.floats(0.0, 3 * DAY)),
            st.tuples(st.just("is set by"), st.floats(-2 * DAY, 2 * DAY)),
            st.tuples(st.just("stop"), st.floats(0.0, DAY)),
        ),
        max_size=8,
    )
)
def test_each_time_counts_once_whatever_happens_to_the_clock(steps: list[tuple[str, float]]) -> None:
    often = Trigger("often", "free", "cron", schedule=parse_cron("0 */2 * * *"))
    stage = Stage(NIGHTLY, often)
    for what, amount in steps:
        match what:
            case "passes":
                stage.advance(amount, ends_all=True)
            case "is set by":
                stage.wall += amount
                stage.look()
                for name in [*stage.running]:
                    stage.end(name)
            case "stop":
                stage.core.stop(stage)
                stage.advance(amount)
                stage.core.release()
    for name in ("nightly", "often"):
        due = [round(wall / 60) for wall, one in stage.started if one == name]
        assert len({*due}) == len(due)
    lived = sum(amount for what, amount in steps if what == "passes")
    assert len(stage.started) <= 2 * (lived / (2 * HOUR) + 2)


@given(st.lists(st.tuples(st.integers(-3, 3), st.sampled_from((SKIP, QUEUE, INTERRUPT))), min_size=1, max_size=6))
def test_of_those_that_fire_together_the_highest_priority_runs(kinds: list[tuple[int, str]]) -> None:
    triggers = [on_message(f"t{n}", f"m{n}", priority=one, running=how) for n, (one, how) in enumerate(kinds)]
    stage = Stage(*triggers)
    stage.message(*(one.name for one in triggers))
    highest = max(one.priority for one in triggers)
    [running] = stage.running
    assert next(one.priority for one in triggers if one.mission == running) == highest
    begun = {one.name: one for one in triggers}
    order = [begun[name].priority for _, name in stage.started]
    assert all(earlier <= later for earlier, later in pairwise(order))  # only as high a one ends one that began
    queued = [one for one in triggers if one.running == QUEUE and one.mission != running]
    before = len(stage.started)
    while stage.running:
        stage.end(stage.running[0])
    later = [begun[name].priority for _, name in stage.started[before:]]
    assert later == sorted(later, reverse=True)
    assert {name for _, name in stage.started} >= {one.name for one in queued}


def test_one_that_skips_starts_nothing_while_another_mission_is_in_the_way() -> None:
    stage = Stage(on_message("bell", "greet"), on_message("free"))
    stage.running = ["clean"]
    stage.message("bell", "free")
    stage.end("clean")
    assert stage.told == ["bell: mission clean is in the way", "free starts free"]


def test_one_that_queues_waits_for_the_end_and_comes_once() -> None:
    stage = Stage(on_message("bell", "greet", running=QUEUE))
    stage.running = ["clean"]
    stage.message("bell")
    stage.message("bell")
    stage.end("clean")
    stage.end("greet")
    assert stage.told == ["bell waits for clean", "bell: it waits already", "bell starts greet"]


def test_one_that_interrupts_ends_the_other_for_good() -> None:
    stage = Stage(on_message("empty", "dock", running=INTERRUPT))
    stage.running = ["clean"]
    stage.message("empty")
    stage.end("dock")
    assert stage.told == ["empty cancels clean", "empty starts dock"]
    assert stage.running == []


def test_it_does_not_end_what_a_higher_one_has_started_until_that_is_over() -> None:
    stage = Stage(on_message("empty", "dock", priority=10), on_message("bell", "greet", running=INTERRUPT))
    stage.message("empty")
    stage.message("bell")
    stage.end("dock")
    stage.running = ["dock"]  # now a person has started it
    stage.message("bell")
    assert stage.told[1:] == [
        "bell: mission dock is in the way, with a higher priority",
        "bell cancels dock",
        "bell starts greet",
    ]


@pytest.mark.parametrize("running", [SKIP, INTERRUPT])
def test_a_mission_that_runs_is_not_started_anew(running: str) -> None:
    stage = Stage(on_message("empty", "dock", running=running))
    stage.message("empty")
    stage.message("empty")
    assert stage.told == ["empty starts dock", "empty: mission dock is running"]


def test_a_condition_starts_it_when_it_begins_to_hold_and_only_then() -> None:
    stage = Stage(Trigger("empty", "free", "when"))
    for number, holds in enumerate([True, True, False, True]):
        stage.now = 2.0 * number
        stage.core.condition("empty", holds, stage.now, stage)
        stage.core.turn(stage.wall, stage)
        if stage.running:
            stage.end("free")
    assert len(stage.started) == 2


def test_a_stop_forgets_what_has_fired_and_nothing_comes_late() -> None:
    stage = Stage(
        NIGHTLY, on_message("bell", "greet", running=QUEUE), Trigger("empty", "dock", "when"), on_message("free")
    )
    stage.running = ["drive"]
    stage.message("bell")
    stage.core.stop(stage)
    stage.core.condition("empty", True, stage.now, stage)
    stage.message("free")
    stage.advance(23 * HOUR)
    stage.end("drive")
    stage.core.release()
    stage.advance(HOUR)
    stage.core.condition("empty", True, stage.now, stage)
    stage.core.turn(stage.wall, stage)
    assert stage.started == []
    why = "the robot is stopped"
    assert stage.told == ["bell waits for drive", f"bell: {why}", f"empty: {why}", f"free: {why}", f"nightly: {why}"]


@pytest.mark.parametrize(
    ("outcome", "result", "starts"),
    [
        ("", "success", True),
        ("", "failure", True),
        ("", "halted", False),
        ("success", "success", True),
        ("success", "failure", False),
        ("halted", "halted", True),
    ],
)
def test_the_end_of_a_mission_starts_another_one(outcome: str, result: str, starts: bool) -> None:
    stage = Stage(Trigger("after", "dock", "ends", ends="clean", outcome=outcome))
    stage.running = ["clean", "free"]
    stage.end("clean", result)
    assert stage.running == (["free", "dock"] if starts else ["free"])


def test_a_mission_that_starts_itself_does_so_once_a_second_at_most() -> None:
    stage = Stage(Trigger("again", "free", "ends", ends="free"))
    stage.running = ["free"]
    for _ in range(100):
        if stage.running:
            stage.end("free", "failure")
        stage.now += 0.1
    assert stage.told == ["again starts free", "again: it has fired within the last 1 s"]


def test_a_refusal_is_told() -> None:
    stage = Stage(on_message("bell", "greet"))
    stage.refusal = "the robot has no mission 'greet'"
    stage.message("bell")
    assert stage.told == ["bell: the robot has no mission 'greet'"]


def test_it_looks_at_the_clock_at_the_time_itself_and_often_enough_to_see_that_it_was_set() -> None:
    stage = Stage(NIGHTLY)
    assert stage.core.next_look(0.0, MONDAY) == CHECK
    assert stage.core.next_look(5.0, MONDAY + 22 * HOUR - 10.0) == 15.0
    assert stage.core.next_time("nightly", MONDAY) == MONDAY + 22 * HOUR
    assert Stage(on_message("bell")).core.next_look(0.0, MONDAY) is None
