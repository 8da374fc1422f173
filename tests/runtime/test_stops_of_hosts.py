"""Stops of a robot on several hosts: all agree, and none is released by somebody who did not know of it."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.runtime.channel import HostReport, StopMark
from rbxcompose.runtime.supervision.members import Member
from rbxcompose.runtime.supervision.stop_latch import StopLatch
from rbxcompose.sdk.component import RobotHeld
from tests.runtime.stage import Stage

HOSTS = ("robot", "desk", "cloud")
STOP, RELEASE, SEND = "stop", "release", "send"
STEPS = st.lists(st.tuples(st.sampled_from([STOP, RELEASE, SEND]), st.sampled_from(HOSTS), st.sampled_from(HOSTS)))


class Hosts:
    """A latch on each host, and what they send each other."""

    def __init__(self) -> None:
        self.latches: dict[str, StopLatch] = {}
        for host in HOSTS:
            stage = Stage()
            stage.run_id = host
            self.latches[host] = StopLatch(stage, lambda: [], lambda: 0.0)

    def send(self, sender: str, receiver: str, run: str | None = None) -> None:
        if sender != receiver:
            report = HostReport(sender, "1", run or sender, stop=self.latches[sender].shared)
            self.latches[receiver].heard_host(report)

    def exchange(self) -> None:
        for _ in range(3):
            for sender in HOSTS:
                for receiver in HOSTS:
                    self.send(sender, receiver)

    def marks_known_to(self, host: str) -> set[StopMark]:
        latch = self.latches[host]
        seen = [latch.shared, *latch._others.values()]
        return {other.own for other in seen if other.own is not None}

    def are_stopped(self) -> set[bool]:
        return {latch.is_stopped for latch in self.latches.values()}


@given(STEPS)
def test_all_hosts_agree_in_the_end_and_are_stopped_while_any_stop_has_not_been_released(
    steps: list[tuple[str, str, str]],
) -> None:
    hosts, issued, released = Hosts(), set[StopMark](), set[StopMark]()
    for what, host, other in steps:
        if what == STOP:
            hosts.latches[host].set("somebody")
            issued |= hosts.marks_known_to(host)
            assert hosts.latches[host].is_stopped
        elif what == RELEASE:
            released |= hosts.marks_known_to(host)
            hosts.latches[host].release()
        else:
            hosts.send(host, other)
    hosts.exchange()
    assert hosts.are_stopped() == {bool(issued - released)}


def test_a_host_that_is_started_again_releases_nothing() -> None:
    hosts = Hosts()
    hosts.latches["robot"].set("the command 'stop'")
    hosts.exchange()
    hosts.latches["robot"] = Hosts().latches["robot"]
    hosts.send("robot", "desk", run="the next one")
    assert hosts.latches["desk"].is_stopped
    hosts.send("desk", "robot")
    assert hosts.latches["robot"].is_stopped


def test_nobody_releases_what_a_component_of_another_host_holds() -> None:
    hosts = Hosts()
    hosts.latches["robot"].receive(Member("robot"), RobotHeld("estop", "the button is pressed"))
    hosts.exchange()
    assert hosts.latches["desk"].holds == {"estop": "the button is pressed"}
    hosts.latches["desk"].release()
    hosts.exchange()
    assert hosts.are_stopped() == {True}
    hosts.latches["robot"].receive(Member("robot"), RobotHeld("estop", ""))
    hosts.exchange()
    hosts.latches["desk"].release()
    hosts.exchange()
    assert hosts.are_stopped() == {False}
