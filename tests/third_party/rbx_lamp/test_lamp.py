"""The lamp on a bench."""

from __future__ import annotations

from itertools import pairwise

from rbx_lamp.msgs import Blink, Dimmed
from rbx_lamp.signals import CoolDown, read_character

from rbxcompose.msgs.std_msgs import Bool, Empty, Float64
from rbxcompose.sdk import Outcome
from rbxcompose.testing import Bench, instance


def test_it_flashes_as_often_as_it_is_asked_to() -> None:
    """Count how often the light goes on, and collect how the goal ends."""
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


def test_it_fades_and_tells_when_it_is_as_bright_as_wanted() -> None:
    """Order half of the light, and more than there is."""
    bench = Bench(instance("light", "lamp"))
    ends = bench.collect("dim/ended", Dimmed)
    bench.publish("dim", Float64(data=0.5))
    bench.advance(0.9)
    assert ends == []
    bench.advance(0.2)
    bench.publish("dim", Float64(data=2.0))
    assert ends == [Dimmed(True, "", 0.5), Dimmed(False, "no lamp is 2 bright", 0.5)]


def test_who_gives_an_order_up_hears_no_more_of_it() -> None:
    """Halt it halfway."""
    bench = Bench(instance("light", "lamp"))
    ends = bench.collect("dim/ended", Dimmed)
    bench.publish("dim", Float64(data=0.5))
    bench.advance(0.5)
    bench.publish("dim/halt", Empty())
    bench.advance(5.0)
    assert ends == []


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
