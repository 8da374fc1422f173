"""How often messages come on topics is counted while somebody looks."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.console.feeds import SHORTEST, TopicRates


class Bus:
    """Topics that somebody listens to."""

    def __init__(self) -> None:
        self.takers: dict[str, Callable[[bytes], None]] = {}
        self.rates = TopicRates(self.listen)

    def listen(self, topic: str, take: Callable[[bytes], None]) -> Callable[[], None]:
        assert topic not in self.takers
        self.takers[topic] = take
        return lambda: self.takers.__delitem__(topic)


@given(st.lists(st.tuples(st.integers(0, 20), st.floats(SHORTEST, 10.0)), min_size=1))
def test_each_message_counts_once_in_the_period_in_which_it_came(periods: list[tuple[int, float]]) -> None:
    bus, now = Bus(), 0.0
    assert bus.rates.look(["/odom"], now) == {}
    for messages, period in periods:
        for _ in range(messages):
            bus.takers["/odom"](b"")
        now += period + 1e-6
        assert bus.rates.look(["/odom"], now)["/odom"] == pytest.approx(messages / (period + 1e-6), rel=1e-6)


def test_only_topics_that_are_there_are_listened_to_and_none_at_rest() -> None:
    bus = Bus()
    bus.rates.look(["/odom", "/scan"], 0.0)
    assert bus.rates.look(["/scan", "/tf"], 2.0) == {"/scan": 0.0}
    assert bus.takers.keys() == {"/scan", "/tf"}
    bus.takers["/tf"](b"")
    assert bus.rates.look(["/scan", "/tf"], 2.1) == {"/scan": 0.0}  # another page, at nearly the same time
    assert bus.rates.look(["/scan", "/tf"], 3.0) == {"/scan": 0.0, "/tf": 1.0}
    bus.rates.rest()
    assert bus.takers == {}
    assert bus.rates.look(["/tf"], 9.0) == {}
