"""Muxes: what one adds to a command within a process, and how long after the last command the stop leaves."""

from __future__ import annotations

from benchmarks.measuring import Row, in_turns
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance

MEASURES = ("rbxcompose/bus", "rbxcompose/domains/muxes")

MANY, ROUNDS = 500, 25  # commands per sample
PACE = 0.01  # [s] of robot time between two commands
TIMEOUT = 0.5  # [s]


def rows() -> list[Row]:
    """Return the figures of muxes."""
    return [_added(), _stop()]


def _robot() -> Bench:
    inputs = {"teleop": {"priority": 100, "timeout": TIMEOUT}, "navigation": {"priority": 10, "timeout": TIMEOUT}}
    return Bench(instance("cmd_vel", "mux", {"output": "cmd_vel", "inputs": inputs}))


def _added() -> Row:
    """Return what a command costs from its publisher to its subscriber, through a mux and without one."""
    robot, taken = _robot(), list[Twist]()
    robot.bus.subscribe("base", "/cmd_vel", Twist, Qos.COMMAND, taken.append)
    robot.bus.subscribe("base", "/direct", Twist, Qos.COMMAND, taken.append)
    through, direct = (
        robot.bus.publisher("source", topic, Twist, Qos.COMMAND) for topic in ("/cmd_vel/navigation", "/direct")
    )
    command = Twist(linear=Vector3(x=0.2))

    def sent(publisher: object) -> None:
        for _ in range(MANY):
            publisher(command)  # type: ignore[operator]
            robot.advance(PACE)

    ours, peer = in_turns(lambda: sent(through), lambda: sent(direct), rounds=ROUNDS)
    if len(taken) < 2 * MANY * ROUNDS:
        raise ValueError("commands were lost")
    return Row(
        name="a command through a mux, in one process",
        unit="µs",
        how="from publisher to subscriber, robot time stepped by 10 ms between two; theirs: the same without a mux",
        ours=1e6 * ours.median / MANY,
        p99=1e6 * ours.p99 / MANY,
        peer=1e6 * peer.median / MANY,
        against="no mux",
        most=100,
    )


def _stop() -> Row:
    """Return how long after the timeout of the last source the stop reaches the base, in robot time."""
    robot, times = _robot(), list[float]()
    robot.bus.subscribe("base", "/cmd_vel", Twist, Qos.COMMAND, lambda message: times.append(robot.clock.now()))
    robot.publish("/cmd_vel/navigation", Twist(linear=Vector3(x=0.2)))
    robot.advance(2 * TIMEOUT)
    began, stopped = times
    return Row(
        name="timeout of the last source to the stop at the base",
        unit="ms",
        how="robot time; topic_tools, twist_mux and yocs_cmd_vel_mux send none",
        ours=round(1e3 * (stopped - began - TIMEOUT), 6),
        most=20,
    )
