"""Who drives: one client, for as long as it keeps sending, and no faster than allowed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.console.lease import LEASE, DriveLimits
from rbxcompose.domains.console.protocol import MOST_SUBSCRIPTIONS, Advertise, Publish, Withdraw
from rbxcompose.msgs.geometry_msgs import Twist, TwistStamped, Vector3
from tests.console.clients import LIMITS, TELEOP, TWIST, Client, Room

REST = Publish(TELEOP, Twist())


def drives(client: Client, x: float = 0.2, **fields: Any) -> list[dict[str, Any]]:
    return client.does("publish", topic=TELEOP, msg={"linear": {"x": x}}, **fields)


def commands(room: Room) -> list[Publish]:
    return [request for request in room.asked() if isinstance(request, Publish)]


def speeds(room: Room) -> list[float]:
    found: list[Any] = [command.message for command in commands(room)]
    return [message.linear.x for message in found]


def driver(room: Room, name: str = "Anna") -> Client:
    client = room.client()
    assert client.calls("/console/drive", {"take": True, "name": name})["success"]
    return client


def test_only_the_holder_drives() -> None:
    room = Room()
    other, anna = room.client(), driver(room)
    assert "'Anna' drives" in drives(other)[0]["msg"]
    answer = {"success": False, "holder": "Anna", "message": "'Anna' drives"}
    assert other.calls("/console/drive", {"take": True, "name": "Ben"}) == answer
    assert drives(anna) == []
    assert speeds(room) == [0.2]
    assert other.calls("/console/drive", {"take": False}) == {"success": True, "holder": "Anna", "message": ""}
    assert room.bridge.lease.holder == "Anna"


def test_a_lease_lasts_as_long_as_commands_come() -> None:
    room = Room()
    anna = driver(room)
    for _ in range(20):
        room.wait(0.4)
        assert drives(anna) == []
    assert set(speeds(room)) == {0.2}
    room.wait(LEASE - 0.02)
    assert commands(room) == []
    room.wait(3.0)
    assert commands(room) == [REST]  # once
    assert room.bridge.lease.holder == ""
    assert "drive lease" in drives(anna)[0]["msg"]
    driver(room, "Ben")


def test_a_lease_that_is_over_stops_the_robot_before_anything_else_even_if_nobody_looked() -> None:
    room = Room()
    anna = driver(room)
    room.now = 1.0
    assert len(drives(anna)) == 1
    assert commands(room) == [REST]


def test_who_lets_go_or_is_cut_off_stops_the_robot_once() -> None:
    for leave in (Client.leaves, lambda client: client.calls("/console/drive", {"take": False})):
        room = Room()
        anna = driver(room)
        drives(anna)
        room.asked()
        leave(anna)
        room.wait(2.0)
        assert commands(room) == [REST]
        driver(room, "Ben")


def test_who_withdraws_its_publisher_lets_go() -> None:
    room = Room()
    anna = driver(room)
    drives(anna)
    room.asked()
    assert anna.does("unadvertise", topic=TELEOP) == []
    assert room.asked() == [REST, Withdraw(Advertise, TELEOP)]
    assert room.bridge.lease.holder == ""
    room.wait(2.0)
    assert room.asked() == []


def test_who_cannot_advertise_more_cannot_drive() -> None:
    room = Room()
    anna = room.client()
    for count in range(MOST_SUBSCRIPTIONS):
        room.now += 0.1
        anna.does("advertise", topic=f"/t{count}", type="std_msgs/String")
    assert "at most" in anna.calls("/console/drive", {"take": True})
    assert room.bridge.lease.client is None


def test_a_gateway_that_ends_stops_the_robot() -> None:
    room = Room()
    drives(driver(room))
    room.asked()
    room.requests += room.bridge.stop_driving(room.now, 0)
    assert commands(room) == [REST]
    room.requests += room.bridge.stop_driving(room.now, 0)
    assert commands(room) == []


def test_late_commands_are_dropped_and_renew_nothing() -> None:
    room = Room()
    anna = driver(room)
    room.now = 0.1
    assert drives(anna, sent=90_000) == []  # took as long as it takes, by a clock that nobody has set
    room.now = 0.2
    assert drives(anna, sent=90_050) == []  # 50 ms slower
    room.now = 0.5
    assert drives(anna, sent=90_300) == []
    room.now = 0.9
    (status,) = drives(anna, 0.4, sent=90_500)
    assert (status["level"], "300 ms late" in status["msg"]) == ("warning", True)
    assert speeds(room) == [0.2] * 3
    room.wait(0.2)
    assert commands(room) == [REST]


def test_a_network_that_becomes_slow_is_never_taken_for_a_clock() -> None:
    room = Room()
    anna = driver(room)
    drives(anna, sent=0)
    for count in range(1, 1000):
        room.now = count * 0.1
        anna.calls("/console/drive", {"take": True})
        assert "late" in drives(anna, sent=count * 100 - 400)[-1]["msg"]


@pytest.mark.parametrize("drift", [-1e-4, 0.0, 1e-4])
def test_a_clock_that_drifts_makes_nothing_late(drift: float) -> None:
    room = Room()
    anna = driver(room)
    for count in range(200):  # more than half an hour
        room.now = 10.0 * count
        anna.calls("/console/drive", {"take": True})
        assert drives(anna, sent=1000 * room.now * (1 + drift)) == []


@pytest.mark.parametrize("sent", ["now", True, None, 1e300, [], -1e16])
def test_a_time_that_is_none_is_refused(sent: object) -> None:
    room = Room()
    (status,) = drives(driver(room), sent=sent)
    assert "'sent'" in status["msg"]
    assert commands(room) == []


@given(st.floats(allow_nan=False), st.floats(allow_nan=False), st.floats(allow_nan=False))
def test_nothing_is_faster_than_allowed(x: float, y: float, turn: float) -> None:
    room = Room()
    anna = driver(room)
    message = {"linear": {"x": x, "y": y, "z": 9}, "angular": {"x": 9, "z": turn}}
    anna.does("publish", topic=TELEOP, msg=message)
    for command in commands(room):
        twist: Any = command.message
        assert twist.linear.x**2 + twist.linear.y**2 <= 0.25 + 1e-9
        assert abs(twist.angular.z) <= 1.0
        assert (twist.linear.z, twist.angular.x) == (0.0, 0.0)


def test_a_direction_is_kept_and_a_number_that_is_none_is_refused() -> None:
    room = Room()
    anna = driver(room)
    anna.does("publish", topic=TELEOP, msg={"linear": {"x": 0, "y": -4}})
    assert commands(room) == [Publish(TELEOP, Twist(linear=Vector3(y=-0.5)))]
    anna.does("publish", topic=TELEOP, msg={"linear": {"x": 3, "y": 4}})
    (x,) = speeds(room)
    assert x == pytest.approx(0.3)
    (status,) = drives(anna, None)  # type: ignore[arg-type]
    assert "a velocity is a number" in status["msg"]


def test_stamped_velocities_are_limited_and_stopped_too() -> None:
    room = Room(DriveLimits("/drive", "geometry_msgs/msg/TwistStamped", 0.5, 1.0))
    anna = driver(room)
    anna.does("publish", topic="/drive", msg={"twist": {"linear": {"x": 3}}})
    anna.leaves()
    sent: list[Any] = [command.message for command in commands(room)]
    assert all(isinstance(message, TwistStamped) for message in sent)
    assert [message.twist.linear.x for message in sent] == [0.5, 0.0]
    assert all(message.header.stamp.sec == 5 for message in sent)


def test_a_robot_that_does_not_drive_says_so() -> None:
    client = Room(None).client()
    assert client.calls("/console/drive", {"take": True})["message"] == "this robot does not drive"
    assert client.does("publish", topic=TELEOP, msg={}) == []


def test_a_name_is_shown_as_text() -> None:
    room = Room()
    room.client().calls("/console/drive", {"take": True, "name": "\x1b[2J" + "x" * 500})
    assert room.bridge.lease.holder == "[2J" + "x" * 61


def test_everybody_sees_who_drives() -> None:
    room = Room()
    viewer = room.client()
    assert viewer.does("subscribe", topic="/console/windows/drive")[0]["msg"] == {"answer": {"holder": ""}}
    driver(room)
    assert viewer.gets()[0]["msg"] == {"answer": {"holder": "Anna"}}
    room.wait(LEASE + 0.1)
    assert viewer.gets()[0]["msg"] == {"answer": {"holder": ""}}


def test_a_page_that_knows_no_lease_has_it_while_it_moves_by_whatever_topic_leads_to_the_base() -> None:
    room = Room(replace(LIMITS, aliases=frozenset({"/cmd_vel"})))
    old = room.client()

    def sends(x: float) -> list[dict[str, Any]]:
        return old.does("publish", topic="/cmd_vel", type=TWIST, msg={"linear": {"x": x}})

    assert old.does("advertise", topic="cmd_vel", type="geometry_msgs/Twist") == []
    assert sends(0.0) == []
    assert speeds(room) == []
    for _ in range(4):
        assert sends(3.0) == []
        room.wait(0.2)
    assert room.bridge.lease.holder == f"client {old.number}"
    assert sends(0.0) == []
    assert speeds(room) == [0.5] * 4 + [0.0]
    for _ in range(5):
        room.wait(0.2)
        assert sends(0.0) == []
    assert room.bridge.lease.holder == ""
    driver(room)
    assert sends(0.0) == []
    assert "'Anna' drives" in sends(0.1)[0]["msg"]


def test_a_client_that_asks_for_the_lease_never_gets_it_by_a_late_command() -> None:
    room = Room()
    anna = driver(room)
    room.wait(LEASE + 0.1)
    assert "drive lease" in drives(anna)[0]["msg"]
    assert speeds(room) == [0.0]
