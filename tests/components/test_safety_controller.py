"""The shell of the safety controller: what it listens to, and what it tells."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import ValidationError

from rbxcompose.base.levels import Level
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.rbxcompose_msgs import Switches
from rbxcompose.msgs.std_msgs import Empty, Header
from rbxcompose.testing import Bench, instance

AT_REST = Twist()


def ring(is_on: bool) -> Switches:
    """Return a message of a single switch ahead."""
    return Switches(Header(), ("ring",), np.zeros(1), (is_on,))


def test_it_holds_the_base_until_its_sensors_speak_and_reports_one_that_never_does() -> None:
    bench = Bench(instance("guard", "safety_controller", {"evades": ["ring"], "holds": []}), start=False)
    statuses, commands = bench.statuses("guard"), bench.collect("/cmd_vel", Twist)
    bench.advance(2.0)  # others are not active yet
    bench.host.start()
    bench.advance(0.4)
    assert {status.level for status in statuses} == {Level.OK}
    bench.advance(0.4)
    assert (statuses[-1].level, statuses[-1].message) == (Level.ERROR, "holds the base: ring is silent")
    assert commands
    assert all(command == AT_REST for command in commands)
    bench.publish("/ring", ring(False))
    bench.advance(0.1)
    assert (statuses[-1].level, statuses[-1].message) == (Level.OK, "nothing is felt")


def test_it_reacts_to_a_message_at_once_and_says_nothing_while_nothing_is_felt() -> None:
    bench = Bench(instance("guard", "safety_controller", {"evades": ["front/ring"], "holds": [], "pause": "0 s"}))
    for _ in range(10):
        bench.publish("/front/ring", ring(False))
        bench.advance(0.1)
    commands = bench.collect("/cmd_vel", Twist)
    bench.publish("/front/ring", ring(False))
    bench.advance(0.012)  # between two steps
    assert commands == []
    bench.publish("/front/ring", ring(True))
    assert [command.linear.x for command in commands] == [-0.1]


@pytest.mark.parametrize("angle", [(), (0.0, 1.0), (math.nan,), (math.inf,)])
def test_a_message_that_it_cannot_read_counts_as_a_broken_sensor(angle: tuple[float, ...]) -> None:
    bench = Bench(instance("guard", "safety_controller", {"evades": ["ring"], "holds": []}))
    statuses, commands = bench.statuses("guard"), bench.collect("/cmd_vel", Twist)
    bench.publish("/ring", ring(False))
    bench.advance(0.1)
    commands.clear()
    bench.publish("/ring", Switches(Header(), ("ring",), np.array(angle), (True,)))
    assert commands == [AT_REST]
    bench.advance(0.1)
    assert (statuses[-1].level, statuses[-1].message) == (Level.ERROR, "holds the base: ring is silent")
    assert commands
    assert all(command == AT_REST for command in commands)
    bench.publish("/ring", ring(False))
    bench.advance(0.1)
    assert statuses[-1].level == Level.OK
    assert sum("dropped a message on /ring" in text for text in bench.texts()) == 1
    assert bench.host.states()["guard"] == ("active", 0)


def test_it_tells_that_it_works_as_long_as_it_does() -> None:
    bench = Bench(instance("guard", "safety_controller", {"heartbeat": "cmd_vel/guard"}))
    beats = bench.collect("/cmd_vel/guard", Empty)
    bench.advance(1.0)
    assert len(beats) == pytest.approx(20, abs=1)


@pytest.mark.parametrize(("evades", "holds"), [([], []), (["ring"], ["ring"]), (["ring", "ring"], [])])
def test_it_needs_topics_each_once(evades: list[str], holds: list[str]) -> None:
    with pytest.raises(ValidationError, match="each once"):
        instance("guard", "safety_controller", {"evades": evades, "holds": holds})
