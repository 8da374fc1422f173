"""What a supervisor decides about the other hosts of its robot, in virtual time."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.base.levels import Level
from rbxcompose.compiler.plan.model import LinkTls, OtherHost, Plan, Share
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.channel import HostReport, RobotEnd
from rbxcompose.runtime.folder import ClockOffset
from rbxcompose.runtime.plan_requests import PlanComparison
from rbxcompose.runtime.supervision.conductor import INTERRUPTED
from rbxcompose.runtime.supervision.members import Phase
from rbxcompose.runtime.supervision.other_hosts import SILENT
from rbxcompose.runtime.supervision.plan_change import changes, summary
from rbxcompose.sdk.component import MissionOver
from tests.runtime.stage import Stage, robot

BASE = ("base",)


def shared(*, is_optional: bool = False) -> Plan:
    """The robot of the stage, but that its base runs on host `robot` and the rest here, on `desk`."""
    whole = robot()
    base, *rest = whole.instances
    share = Share("desk", (OtherHost("robot", (base,), is_optional),), version="1")
    return replace(whole, instances=tuple(rest), share=share)


def desk(*, is_optional: bool = False) -> Stage:
    stage = Stage(shared(is_optional=is_optional))
    stage.configure("router", "robot", "mission")
    stage.activate()
    return stage


def tell(stage: Stage, state: str = "active", **more: object) -> None:
    """Have host `robot` report."""
    report = HostReport("robot", "1", "first", states=dict.fromkeys(BASE, state))
    stage.speak("router", say.FromHost(replace(report, **more)))  # type: ignore[arg-type]
    stage.activate()


def lost(stage: Stage) -> list[tuple[str, ...]]:
    return [tuple(message.names) for _, message in stage.orders(say.Lost) if isinstance(message, say.Lost)]


def test_a_component_waits_for_one_of_another_host_that_it_starts_after_and_the_robot_for_all_hosts() -> None:
    stage = desk()
    names = [message.names for _, message in stage.orders(say.Activate) if isinstance(message, say.Activate)]
    assert names == [["mux"]], "go_to starts after the base"
    tell(stage, "inactive")
    assert stage.conductor.states["go_to"][0] == "unconfigured"
    tell(stage)
    assert stage.conductor.states["go_to"][0] == "active"
    assert stage.ups == 1


def test_a_host_that_is_optional_is_not_waited_for() -> None:
    assert desk(is_optional=True).ups == 1


def test_components_of_a_silent_host_are_lost_until_it_answers_again_and_nothing_goes_down() -> None:
    stage = desk()
    tell(stage)
    stage.pass_time(SILENT + 1.0)
    assert set(lost(stage)) == {BASE}
    assert (Level.WARN, "host 'robot' does not answer") in stage.records
    before = len(lost(stage))
    tell(stage)
    stage.pass_time(SILENT / 2)
    assert len(lost(stage)) == before
    assert (Level.WARN, "host 'robot' answers again") in stage.records
    assert stage.conductor.phase is Phase.RUNNING


def test_what_failed_on_another_host_blocks_what_depends_on_it_here() -> None:
    stage = desk()
    tell(stage)
    tell(stage, "failed")
    assert stage.conductor.blocked.causes["go_to"] == "base"


def test_the_end_of_the_robot_on_one_host_is_its_end_here_but_not_that_of_a_run_before() -> None:
    end = RobotEnd(3, "mission patrol: failure")
    stage = desk()
    tell(stage, run="old", is_going_down=True, end=end)
    assert not stage.conductor.is_going_down
    tell(stage)
    tell(stage, is_going_down=True, end=end)
    assert (stage.conductor.exit_code, stage.conductor.reason) == (3, "mission patrol: failure (host 'robot')")


def test_the_end_of_a_mission_is_told_to_all_hosts_and_a_signal_is_for_one() -> None:
    stage = desk()
    tell(stage)
    stage.speak("mission", MissionOver("patrol", "success"))
    assert stage.reports[-1].end == RobotEnd(0, "mission patrol: success")
    other = desk()
    other.conductor.go_down(INTERRUPTED, "interrupted")
    assert other.reports[-1].is_going_down
    assert other.reports[-1].end is None


def test_hosts_with_other_files_are_told_once() -> None:
    stage = desk()
    for _ in range(3):
        tell(stage, version="2")
    assert len([text for _, text in stage.records if "other files" in text]) == 1


def test_a_clock_that_is_too_far_off_is_told_once_and_again_when_it_is_right() -> None:
    stage = desk()
    for offset in (0.3, 0.31, 0.001):
        tell(stage, clock=ClockOffset(offset, 0.001))
        assert stage.conductor.hosts.clocks == {"robot": ClockOffset(offset, 0.001)}
    told = [text for _, text in stage.records if "clock" in text]
    assert ["300.0 ms ahead" in told[0], "1.0 ms ahead" in told[1], len(told)] == [True, True, 2]


def test_a_changed_link_is_opened_again_by_the_router_and_the_other_files_are_known_to_be_the_same() -> None:
    stage = desk()
    tell(stage)
    before = stage.conductor.plan
    assert before.share is not None
    after = replace(before, share=replace(before.share, version="2", downsample={"/odom": 1.0}))
    found = changes(before, after)
    assert (found.shares_change, found.links_change, found.impossible) == (True, True, ())
    opens_again = "they open again, and what moves across them brakes meanwhile"
    assert summary(found) == f"links: other data may cross; {opens_again}"
    assert PlanComparison.of(found, 1, "", ("a mission runs",)).said == (summary(found), "a mission runs")
    stage.conductor.change(found, lambda text, is_refused: None)
    assert [process for process, _ in stage.orders(say.Adopt)] == ["router"]
    tell(stage, version="2", run="second")
    assert not any("runs other files" in text for _, text in stage.records)
    only_files = changes(after, replace(after, share=replace(before.share, version="3", downsample={"/odom": 1.0})))
    assert (only_files.shares_change, only_files.links_change) == (True, False)
    assert summary(only_files) == "nothing to do"
    assert changes(after, replace(after, share=None)).impossible


def test_a_change_of_the_security_of_links_says_so_with_their_ends() -> None:
    plan = shared()
    assert plan.share is not None
    plain = replace(plan, share=replace(plan.share, connect=("tcp/10.0.0.2:7500",)))
    secured = replace(plan.share, tls=LinkTls("ca", "certificate", "key"), connect=("tls/10.0.0.2:7500",))
    words = "links: none -> mtls, tcp/10.0.0.2:7500 -> tls/10.0.0.2:7500; they open again"
    assert summary(changes(plain, replace(plan, share=secured))).startswith(words)


def test_who_does_not_start_because_another_failed_keeps_no_host_waiting() -> None:
    stage = desk()
    tell(stage, "blocked")
    assert stage.conductor.state_of("go_to")[0] == "blocked"
    stage.pass_time(0.5)
    assert (stage.reports[-1].states["go_to"], stage.ups) == ("blocked", 1)
