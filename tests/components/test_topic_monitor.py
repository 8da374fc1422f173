"""A topic of anybody is watched by a few lines of YAML."""

from __future__ import annotations

from rbxcompose.base.levels import Level
from rbxcompose.msgs.geometry_msgs import PoseStamped
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.testing.bench import Bench, instance


def test_rate_and_stamps_of_a_topic_are_told() -> None:
    config = {"topic": "place", "message": "geometry_msgs/PoseStamped", "rate": "5 Hz", "oldest": "0.5 s"}
    bench = Bench(instance("watch", "topic_monitor", config))
    found = bench.statuses("watch")

    def told(rate: float, age: float) -> tuple[int, str]:
        for _ in range(int(10 * rate)):
            bench.publish("place", PoseStamped(header=Header(stamp=to_time(bench.clock.stamp() + 1 - int(age * 1e9)))))
            bench.advance(1 / rate)
        bench.advance(0.05)
        return found[-1].level, found[-1].message

    assert told(5.0, 0.0) == (Level.OK, "5 Hz")
    assert told(2.0, 0.0) == (Level.WARN, "2 Hz instead of at least 5 Hz")
    assert told(5.0, 0.75) == (Level.ERROR, "a stamp is 0.75 s old, at most 0.5 s is usual")
    bench.advance(10.0)
    assert found[-1].level == Level.ERROR
