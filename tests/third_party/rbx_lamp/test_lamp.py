"""The lamp on a bench."""

from __future__ import annotations

from itertools import pairwise

from rbx_lamp.msgs import Blink
from rbx_lamp.signals import CoolDown, read_character

from rbxcompose.msgs.std_msgs import Bool
from rbxcompose.sdk import Outcome
from rbxcompose.testing import Bench, instance


def test_it_flashes_as_often_as_it_is_asked_to() -> None:
    """Count how often the light goes on, and hear how the goal ends."""
    bench = Bench(instance("light", "lamp", {"period": "400 ms"}))
    lights = bench.collect("lamp/light", Bool)
    outcomes: list[Outcome] = []
    blink = bench.bus.action_client("test", "blink", Blink)
    blink(Blink.Goal(flashes=3), lambda ended: outcomes.append(ended.outcome))
    bench.advance(2.0)
    states = [False, *(message.data for message in lights)]
    assert outcomes == [Outcome.SUCCEEDED]
    assert sum(now and not before for before, now in pairwise(states)) == 3


def test_what_cannot_be_counted_is_refused() -> None:
    """Ask for nothing."""
    bench = Bench(instance("light", "lamp"))
    outcomes: list[Outcome] = []
    bench.bus.action_client("test", "blink", Blink)(Blink.Goal(), lambda ended: outcomes.append(ended.outcome))
    bench.advance(1.0)
    assert outcomes == [Outcome.REJECTED]


def test_a_character_is_read_as_charts_have_it() -> None:
    """Read one of each form, and one of none."""
    assert read_character("Fl(3) 10s") == {"flashes": 3, "period": 10.0}
    assert read_character("Fl 5s") == {"flashes": 1, "period": 5.0}
    assert read_character("always on") == "unreadable"


def test_cooling_takes_its_time_and_can_be_held() -> None:
    """Hold it in the middle."""
    cooling = CoolDown()
    cooling.start(flashes=4)
    assert [cooling.step(10.0), cooling.step(11.0)] == [None, None]
    cooling.pause(11.0)
    assert [cooling.step(20.0), cooling.step(20.9), cooling.step(21.0)] == [None, None, True]
