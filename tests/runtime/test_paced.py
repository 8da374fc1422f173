"""Diagnostics watch outputs that declare a rate, and tasks that a component adds."""

from __future__ import annotations

from rbxcompose.base.levels import Level
from rbxcompose.msgs.geometry_msgs import PoseStamped
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk import Component, Config, Out, component, heartbeat
from rbxcompose.testing.bench import Bench, instance


@component("toy_paced")
class ToyPaced(Component[Config]):
    """Publishes its place, until it is told to be slow.

    Example:
        paced: {type: toy_paced}
    """

    rate = 10.0
    place = Out(PoseStamped, "place", rate=rate)
    hardware_id = "serial 7"

    def configure(self) -> None:
        """Begin as it should."""
        self.every, self.late, self.steps = 1, 0, 0
        self.add_diagnostic("life", heartbeat)

    def step(self, dt: float) -> None:
        """Publish, only at some steps, with a stamp that may be late [s]."""
        self.steps += 1
        if self.steps % self.every == 0 and self.place.is_wanted:
            self.place(PoseStamped(header=Header(stamp=to_time(self.stamp - self.late * 1_000_000_000))))
        self.status(Level.OK, "steps")


def running() -> tuple[Bench, ToyPaced]:
    bench = Bench(instance("paced", "toy_paced"))
    made = bench.component("paced")
    assert isinstance(made, ToyPaced)
    return bench, made


def test_an_output_is_watched_whether_or_not_anybody_listens() -> None:
    bench, made = running()
    found = bench.statuses("paced: place")
    bench.advance(10.0)
    assert (found[-1].level, found[-1].message) == (Level.OK, "10 Hz")
    made.every = 2
    bench.advance(10.0)
    assert (found[-1].level, found[-1].message) == (Level.WARN, "5 Hz instead of at least 10 Hz")
    made.every = 1_000_000
    bench.advance(10.0)
    assert found[-1].level == Level.ERROR


def test_stamps_that_are_not_of_now_are_told() -> None:
    bench, made = running()
    bench.collect("place", PoseStamped)
    found = bench.statuses("paced: place")
    bench.advance(10.0)
    made.late = 6
    bench.advance(2.0)
    assert (found[-1].level, found[-1].message) == (Level.ERROR, "a stamp is 6 s old, at most 5 s is usual")


def test_tasks_and_hardware_are_reported_and_end_with_the_component() -> None:
    bench, _ = running()
    life, own = bench.statuses("paced: life"), bench.statuses("paced")
    bench.advance(3.0)
    assert life[-1].message == "alive"
    assert own[-1].hardware_id == "serial 7"
    bench.host.retire(["paced"])
    life.clear()
    bench.advance(3.0)
    assert not life
