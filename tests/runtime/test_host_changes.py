"""Components that are exchanged beside others that run, in virtual time."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import pytest

from rbxcompose.base.config import Live, Restart
from rbxcompose.base.levels import Level
from rbxcompose.missions.execution.requests import CancelMission, PauseMission, ResumeMission
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.runtime.process_group.host import Lifecycle
from rbxcompose.sdk import Component, Config, Out, Refused, component
from rbxcompose.testing import Bench, instance
from tests.manifests import turtlebot


class CounterConfig(Config):
    """How it counts."""

    by: Annotated[float, Live()] = 1.0
    """What is added."""
    start: float = 0.0
    """Where it begins."""
    fails: bool = False
    """Cannot be configured."""


@component("toy_counter")
class Counter(Component[CounterConfig]):
    """Counts, and keeps the count of whose place it takes."""

    rate = 10.0
    count = Out(Float32, "count")

    def configure(self) -> None:
        self.total = self.config.start
        if self.config.fails:
            raise OSError("no such device")

    def take_over(self, old: Counter) -> None:
        self.total += old.total

    def reconfigure(self, old: CounterConfig) -> None:
        if self.config.by < 0:
            raise Refused("it counts upwards only")

    def step(self, dt: float) -> None:
        self.total += self.config.by
        self.count(Float32(data=self.total))

    @property
    def occupation(self) -> str:
        return "it counts" if self.config.by else ""

    def brake(self) -> None:
        self.info("braking")

    def deactivate(self) -> None:
        self.info("deactivated")


def bench() -> Bench:
    return Bench(instance("counter", "toy_counter"), instance("other", "toy_counter"))


def test_what_is_retired_brakes_and_is_heard_of_no_more() -> None:
    one = bench()
    heard = one.collect("/diagnostics", DiagnosticArray)
    one.host.retire(["counter", "nobody"])
    one.advance(2.0)
    assert one.texts() == ["counter: braking", "counter: deactivated"]
    assert one.host.states().keys() == {"other"}
    assert {status.name for status in heard[-1].status} == {"other"}


def test_another_takes_the_place_and_goes_on_while_the_neighbour_does_not_notice() -> None:
    one = bench()
    one.advance(1.0)
    neighbour = one.component("other")
    one.host.retire(["counter"])
    one.host.prepare([instance("counter", "toy_counter", {"by": 2.0, "start": 100.0})])
    assert one.host.states()["counter"] == ("inactive", 0)
    one.host.activate(["counter"])
    one.advance(1.0)
    assert one.component("counter").total == 10.0 + 100.0 + 20.0  # type: ignore[attr-defined]
    assert one.component("other") is neighbour
    assert neighbour.total == 20.0  # type: ignore[attr-defined]


def test_a_component_that_waits_for_its_restart_does_not_come_back_beside_its_successor() -> None:
    one = Bench(instance("counter", "toy_counter", {"fails": True}))
    one.host.prepare([instance("counter", "toy_counter")])
    one.host.activate(["counter"])
    one.advance(5.0)
    assert not any("restarted" in text for text in one.texts())
    assert one.host.states()["counter"] == ("active", 0)


def test_settings_that_changed_are_followed_and_what_a_person_has_set_stays() -> None:
    one = bench()
    hosted = one.host.hosted["counter"]
    hosted.reconfigure(CounterConfig(by=5.0))
    new = replace(instance("counter", "toy_counter", {"by": 7.0}), restart=Restart(when="never"))
    assert one.host.follow([new], {"counter": ["restart.when"]}) == {}
    assert hosted.config == CounterConfig(by=5.0)
    assert one.host.follow([new], {"counter": ["by"]}) == {}
    assert hosted.config == CounterConfig(by=7.0)
    assert "counter: set: by = 7.0, by apply" in one.texts()


def test_a_setting_that_is_refused_stays_as_it_was() -> None:
    one = bench()
    new = instance("counter", "toy_counter", {"by": -1.0})
    assert one.host.follow([new], {"counter": ["by"]}) == {"counter": "'counter' refuses: it counts upwards only"}
    assert one.host.hosted["counter"].config == CounterConfig()


def test_work_is_told_as_long_as_it_lasts() -> None:
    one = bench()
    assert one.host.work() == ([], {"counter": "it counts", "other": "it counts"})
    one.host.retire(["other"])
    assert one.host.work() == ([], {"counter": "it counts"})


def test_who_is_blocked_is_not_well_whatever_it_says() -> None:
    one = bench()
    heard = one.collect("/diagnostics", DiagnosticArray)
    one.host.statuses.block({"counter": "waits for other, which failed"})
    one.host.statuses.set("counter", Level.OK, "fine", {})
    one.advance(1.5)
    told = {status.name: (status.level, status.message) for status in heard[-1].status}
    assert told["counter"] == (Level.WARN, "waits for other, which failed")
    assert told["other"][0] == Level.OK
    one.host.statuses.block({})
    one.advance(0.0)
    assert {status.level for status in heard[-1].status} == {Level.OK}
    assert one.host.hosted["counter"].state is Lifecycle.ACTIVE


def test_a_mux_that_was_exchanged_during_a_stop_lets_through_what_comes_after_the_release() -> None:
    one = Bench(plan=turtlebot())
    one.advance(3.0)
    one.host.stop()
    one.advance(2.0)
    mux = next(each for each in one.plan.instances if each.name == "cmd_vel")
    one.host.retire(["cmd_vel"])
    one.host.prepare([mux])
    one.host.activate(["cmd_vel"])
    assert one.component("base").is_at_rest
    one.advance(1.0)
    assert one.component("base").is_at_rest
    one.host.release()
    one.host.ask("mission", ResumeMission())
    one.advance(0.5)
    assert not one.component("base").is_at_rest


@pytest.mark.parametrize("happens", ["it is exchanged", "it raises"])
def test_an_executive_begins_no_mission_that_is_over(happens: str) -> None:
    one = Bench(plan=turtlebot())
    one.advance(3.0)
    one.host.ask("mission", CancelMission())
    one.advance(3.0)
    if happens == "it raises":
        one.host.failed("mission", RuntimeError("oh"))
    else:
        one.host.prepare([next(each for each in one.plan.instances if each.name == "mission")])
        one.host.activate(["mission"])
    one.advance(3.0)
    assert one.component("base").is_at_rest
    assert one.host.work() == ([], {})


def test_a_mission_that_runs_begins_again_when_its_executive_raises() -> None:
    one = Bench(plan=turtlebot())
    one.advance(3.0)
    one.host.failed("mission", RuntimeError("oh"))
    one.advance(3.0)
    assert one.host.work()[1] == {"mission": "mission patrol runs"}


def test_a_mission_that_was_paused_is_still_held_when_it_was_exchanged() -> None:
    one = Bench(plan=turtlebot())
    one.advance(3.0)
    assert one.host.work()[1] == {"mission": "mission patrol runs"}
    one.host.ask("mission", PauseMission())
    mission = next(each for each in one.plan.instances if each.name == "mission")
    one.host.retire(["mission"])
    one.host.prepare([mission])
    one.host.activate(["mission"])
    one.advance(3.0)
    assert one.component("base").is_at_rest
    assert one.host.work() == ([], {})
    one.host.ask("mission", ResumeMission())
    one.advance(2.0)
    assert not one.component("base").is_at_rest
