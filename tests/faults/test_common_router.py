"""A router that robots share is killed. With `links: router`, all that their processes send takes that way."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.zenoh_session import open_client
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.runtime.log import NAME as LOG
from rbxcompose.sdk.ports import Qos
from tests.faults.observer import MOTION
from tests.faults.patrol import LATE, LONGEST_STOP, SPEED, Patrol
from tests.systems.test_links import free_port

ROUTER = "import sys; from rbxcompose.bus.zenoh_session import open_router; at = open_router(sys.argv[1]); input()"
DOWN = 3.0  # [s]; longer than any deadline of the robot
FARTHEST = SPEED * (LONGEST_STOP + LATE)  # [m] that the base moves on, at most


@contextmanager
def router(endpoint: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a router; it is killed at the end."""
    with subprocess.Popen([sys.executable, "-c", ROUTER, endpoint], stdin=subprocess.PIPE) as process:
        try:
            deadline = time.monotonic() + 20.0
            while True:
                try:
                    open_client(endpoint).close()  # type: ignore[no-untyped-call]
                    break
                except ConnectionRefusedError:
                    assert time.monotonic() < deadline
            yield process
        finally:
            process.kill()


@pytest.mark.timeout(120)
def test_without_the_router_the_base_stands_and_with_it_the_patrol_goes_on(tmp_path: Path) -> None:
    endpoint, places = tcp_endpoint(free_port()), list[tuple[float, float, float]]()

    def note(message: Odometry) -> None:
        at = message.pose.pose.position
        places.append((time.monotonic(), at.x, at.y))

    with router(endpoint) as first:
        patrol = Patrol(tmp_path, times=10, more={"bus.router": endpoint, "bus.links": "router"})
        with patrol:
            patrol.observer.listen(MOTION, Odometry, Qos.STATE, note)
            assert patrol.observer.wait_until_it_moves(time.monotonic(), lambda: patrol.is_up)
            before = patrol.running()
            first.kill()
            first.wait()
            killed = time.monotonic()
            time.sleep(DOWN)
            assert places[-1][0] < killed + LATE
            back = time.monotonic()
            with router(endpoint):
                assert patrol.wait_for(lambda: places[-1][0] > back)
                _, *left = next(place for place in places[::-1] if place[0] < back)
                _, *found = next(place for place in places if place[0] > back)
                assert math.dist(left, found) < FARTHEST
                assert patrol.observer.wait_until_it_moves(back, lambda: patrol.is_up)
                assert set(patrol.running()) == set(before)
                log = [json.loads(line) for line in (patrol.state.path / LOG).read_text(encoding="utf-8").splitlines()]
                assert [entry["text"] for entry in log if entry["level"] == "ERROR"] == []
                assert "go_to: sent again" in [entry["text"] for entry in log]
