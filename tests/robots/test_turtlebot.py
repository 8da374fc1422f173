"""The patrol robot, whole, in virtual time: what its user is promised."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import pytest

from rbxcompose.base.geometry import Pose2
from rbxcompose.commands.formats.text import render_text
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.missions.execution.requests import ResumeMission
from rbxcompose.sdk.component import MissionOver
from rbxcompose.testing.bench import Bench, Ran, run_robot

ROBOT = "robots/turtlebot/robot.yaml"
CORNERS = {"corner_1": (1.0, 0.0), "corner_2": (1.0, 1.0), "corner_3": (0.0, 1.0), "corner_4": (0.0, 0.0)}


@pytest.fixture(autouse=True)
def _at_home(repository: Path) -> None:
    """Findings name files as from the repository's root."""


def compiled(*sets: str, profiles: tuple[str, ...] = ()) -> Compilation:
    return compile_robot(ROBOT, sets=sets, profiles=profiles, environment={})


def run_again(*sets: str, profiles: tuple[str, ...] = ()) -> Ran:
    out = compiled(*sets, profiles=profiles)
    assert out.plan, render_text(out.report, out.sources)
    return run_robot(out.plan)


ran = cache(run_again)


def story(run: Ran, source: str = "mission") -> list[str]:
    return [record.text for record in run.bench.records if record.source == source]


def done(run: Ran) -> list[str]:
    """Return what the mission did, in order, without how long it took."""
    return [text.partition(" (")[0] for text in story(run)]


def pose(bench: Bench) -> Pose2:
    found: Pose2 = bench.component("base").core.pose  # type: ignore[attr-defined]
    return found


def at_rest(bench: Bench) -> bool:
    return bench.host.is_at_rest


def test_it_has_no_findings() -> None:
    out = compiled()
    assert list(out.report) == []
    assert out.plan
    assert out.plan.groups == ("world", "robot", "mission")


def test_it_visits_the_corners_twice_and_ends_in_success() -> None:
    run = ran()
    assert run.outcome == "success"
    visited = [text for text in done(run) if text.endswith(": success") and "corner" in text]
    assert visited == [f"go_to {corner}: success" for corner in (*CORNERS, *CORNERS)]
    assert pose(run.bench).distance(Pose2(*CORNERS["corner_4"])) < 0.05
    assert run.bench.host.is_at_rest


def test_it_docks_when_the_battery_is_low_and_resumes_at_the_corner_that_was_cut_short() -> None:
    told = done(ran())
    start = told.index("interrupt battery_low: $battery < $low")
    cut_short = told[start + 1].removesuffix(": halted")
    assert cut_short in {f"go_to {corner}" for corner in CORNERS}
    assert told[start + 1 : start + 9] == [
        f"{cut_short}: halted",
        "2.1.1 Go to dock",
        "go_to dock: success",
        "2.1.2 Recharge",
        "recharge: success",
        f"interrupt battery_low done, back to {cut_short}",
        f"1.1.1 Go to the corner: {cut_short}",
        f"{cut_short}: success",
    ]


def test_two_runs_write_the_same_log_to_the_byte() -> None:
    once = "missions.patrol.with.rounds=1"
    assert ran(once).log == run_again(once).log


@pytest.mark.soak  # `--set` has tests of its own
def test_a_corner_that_was_moved_is_visited_where_it_is_now() -> None:
    run = ran("places.corner_4.x=-50 cm", "missions.patrol.with.rounds=1")
    assert pose(run.bench).distance(Pose2(-0.5, 0.0)) < 0.05


@pytest.mark.soak
def test_the_threshold_decides_how_often_it_docks() -> None:
    assert (
        sum(text == "2.1.2 Recharge" for text in done(ran("missions.patrol.with.low=10 %", "battery.runtime=2 min")))
        == 0
    )
    assert sum(text == "2.1.2 Recharge" for text in done(ran("missions.patrol.with.low=70 %"))) >= 2


def test_a_profile_changes_the_robot() -> None:
    once = "missions.patrol.with.rounds=1"
    runs = [ran(once), ran(once, profiles=("tired",))]
    docked = [sum(text == "2.1.2 Recharge" for text in done(run)) for run in runs]
    assert docked[1] > docked[0]


def test_a_corner_that_cannot_be_reached_in_time_does_not_end_the_patrol() -> None:
    run = ran("places.corner_2.x=5 m", "missions.patrol.with.rounds=1", "battery.runtime=1 h")
    assert run.outcome == "success"
    assert "go_to corner_2: halted" in done(run)
    assert "go_to corner_4: success" in done(run)


def test_a_mission_that_fails_says_why() -> None:
    run = ran("charger.reach=1 mm")
    assert run.outcome == "failure"
    assert any("away from 'dock'" in text for text in story(run, "charger"))


def test_a_stop_brakes_at_once_and_only_a_resume_goes_on() -> None:
    out = compiled("missions.patrol.with.rounds=1")
    assert out.plan
    bench = Bench(plan=out.plan)
    bench.advance(3.0)
    assert not at_rest(bench)
    bench.host.stop()
    bench.advance(0.4)  # 0.3 m/s at 1 m/s^2
    assert at_rest(bench)
    stopped_at = pose(bench)
    bench.advance(5.0)
    bench.host.release()
    bench.advance(5.0)
    assert pose(bench) == stopped_at
    bench.host.ask("mission", ResumeMission())
    bench.run_until(lambda: any(isinstance(event, MissionOver) for event in bench.events))
    assert Ran(bench).outcome == "success"


def test_the_summary_tells_outcome_skills_and_way() -> None:
    facts = ran().bench.host.summary()
    assert facts["mission"]["mission"] == "patrol: success"
    assert facts["mission"]["skills"].startswith("go_to 10 (9 success, 1 halted), recharge 1")
    assert 8.0 < float(facts["base"]["distance driven"].removesuffix(" m")) < 10.0


def test_it_never_exceeds_its_speed_limits() -> None:
    out = compiled("args.speed=0.5 m/s", "missions.patrol.with.rounds=1")
    assert out.plan
    bench = Bench(plan=out.plan)
    speeds = []

    def ended() -> bool:
        velocity = bench.component("base").core.velocity  # type: ignore[attr-defined]
        speeds.append((abs(velocity.linear), abs(velocity.angular)))
        return any(isinstance(event, MissionOver) for event in bench.events)

    bench.run_until(ended)
    assert max(linear for linear, _ in speeds) <= 0.5 + 1e-9
    assert max(angular for _, angular in speeds) <= math.radians(90) + 1e-9
