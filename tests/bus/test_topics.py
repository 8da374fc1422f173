from __future__ import annotations

import math
from typing import Any

import pytest

from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.std_msgs import Float32, String
from rbxcompose.sdk.ports import Qos
from tests.bus.conftest import Alone


def ignore(message: object) -> None:
    """Take a message and do nothing."""


def test_a_message_is_handed_over_by_reference_at_the_same_instant(alone: Alone) -> None:
    got: list[Twist] = []
    alone.bus.subscribe("base", "cmd_vel", Twist, Qos.COMMAND, got.append)
    publish = alone.bus.publisher("teleop", "cmd_vel", Twist, Qos.COMMAND)
    sent = Twist(linear=Vector3(x=0.3))
    publish(sent)
    assert got == []  # never from inside the publisher's call
    alone.settle()
    assert got[0] is sent


def test_a_subscription_knows_the_newest_message_its_age_and_its_source(alone: Alone) -> None:
    alone.settle(after=1.0)
    level = alone.bus.subscribe("charger", "level", Float32, Qos.STATE, ignore)
    assert (level.value, level.age, level.source) == (None, math.inf, None)
    publish = alone.bus.publisher("battery", "level", Float32, Qos.STATE)
    publish(Float32(data=1.0))
    publish(Float32(data=2.0))
    alone.settle(after=0.5)
    assert level.value == Float32(data=2.0)
    assert level.age == 0.5  # since it was put, not since it was handled
    assert level.source is not None
    assert (level.source.sequence, level.source.stamp, level.source.gid) == (2, 1_000_000_000, publish.gid)


@pytest.mark.parametrize(("qos", "kept"), [(Qos.COMMAND, 1), (Qos.STATE, 10), (Qos.BULK, 2)])
def test_a_slow_subscriber_gets_the_newest_and_the_others_are_counted(alone: Alone, qos: Qos, kept: int) -> None:
    got: list[Float32] = []
    subscription = alone.bus.subscribe("slow", "numbers", Float32, qos, got.append)
    publish = alone.bus.publisher("source", "numbers", Float32, qos)
    for number in range(25):
        publish(Float32(data=float(number)))
    alone.settle()
    assert [message.data for message in got] == [float(number) for number in range(25 - kept, 25)]
    assert subscription.dropped == 25 - kept


def test_owners_take_turns_by_name_whoever_subscribed_first(alone: Alone) -> None:
    order: list[str] = []
    for owner in ("c", "a", "b"):
        alone.bus.subscribe(owner, "t", Float32, Qos.STATE, lambda message, owner=owner: order.append(owner))  # type: ignore[misc]
    alone.bus.publisher("source", "t", Float32, Qos.STATE)(Float32())
    alone.settle()
    assert order == ["a", "b", "c"]


def test_names_are_relative_and_types_must_agree(alone: Alone) -> None:
    got: list[object] = []
    alone.bus.subscribe("a", "/x/t", Float32, Qos.STATE, got.append)
    alone.bus.subscribe("a", "x/t", String, Qos.STATE, got.append)
    alone.bus.publisher("b", "x/t", Float32, Qos.STATE)(Float32(data=1.0))
    alone.settle()
    assert got == [Float32(data=1.0)]


@pytest.mark.parametrize("is_heard", [True, False])
def test_a_message_of_another_type_is_the_publishers_mistake_whoever_listens(alone: Alone, is_heard: bool) -> None:
    got: list[object] = []
    if is_heard:
        alone.bus.subscribe("sink", "value", Float32, Qos.STATE, got.append)
    publish: Any = alone.bus.publisher("source", "value", Float32, Qos.STATE)
    for wrong, name in ((String(data="x"), "std_msgs/msg/String"), (Float32, "type"), (1.0, "float")):
        with pytest.raises(TypeError, match=f"^'/value' takes std_msgs/msg/Float32, not {name}$"):
            publish(wrong)
    alone.settle()
    assert got == []


def test_who_subscribes_late_gets_the_last_message_of_each_latched_publisher(alone: Alone) -> None:
    for owner, text in (("a", "1"), ("a2", "2")):
        publish = alone.bus.publisher(owner, "map", String, Qos.LATCHED)
        publish(String(data=f"old {text}"))
        publish(String(data=text))
    late: list[String] = []
    alone.bus.subscribe("late", "map", String, Qos.LATCHED, late.append)
    plain: list[String] = []
    alone.bus.subscribe("plain", "map", String, Qos.STATE, plain.append)
    alone.settle()
    assert [message.data for message in late] == ["1", "2"]
    assert plain == []  # as it is between processes


def test_what_a_publisher_kept_goes_with_it(alone: Alone) -> None:
    alone.bus.publisher("a", "map", String, Qos.LATCHED)(String(data="1"))
    alone.bus.close_owner("a")
    late: list[String] = []
    alone.bus.subscribe("late", "map", String, Qos.LATCHED, late.append)
    alone.settle()
    assert late == []


def test_a_handler_that_raises_is_reported_and_disturbs_nobody(alone: Alone) -> None:
    def fail(message: Float32) -> None:
        raise RuntimeError("broken")

    got: list[Float32] = []
    alone.bus.subscribe("bad", "t", Float32, Qos.STATE, fail)
    alone.bus.subscribe("good", "t", Float32, Qos.STATE, got.append)
    publish = alone.bus.publisher("source", "t", Float32, Qos.STATE)
    publish(Float32())
    publish(Float32())
    alone.settle()
    assert [owner for owner, _ in alone.errors] == ["bad", "bad"]
    assert len(got) == 2


def test_a_component_that_was_closed_hears_nothing_more_and_can_start_again(alone: Alone) -> None:
    got: list[str] = []
    publish = alone.bus.publisher("source", "t", Float32, Qos.STATE)
    alone.bus.subscribe("sink", "t", Float32, Qos.STATE, lambda message: got.append("old"))
    publish(Float32())
    alone.bus.close_owner("sink")
    alone.bus.subscribe("sink", "t", Float32, Qos.STATE, lambda message: got.append("new"))
    alone.settle()
    assert got == []
    publish(Float32())
    alone.settle()
    assert got == ["new"]


def test_after_closing_nothing_is_left(alone: Alone) -> None:
    alone.bus.publisher("a", "t", Float32, Qos.LATCHED)(Float32())
    alone.bus.subscribe("b", "t", Float32, Qos.LATCHED, ignore)
    assert len(alone.bus) == 2
    alone.bus.close_owner("a")
    assert len(alone.bus) == 1
    alone.bus.close_owner("a")
    alone.bus.close()
    assert len(alone.bus) == 0
    alone.settle()
    assert alone.scheduler.next_due() is None
