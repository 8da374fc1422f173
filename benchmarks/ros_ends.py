"""Ends of ROS 1 for `bench_bus`, run by the Python that its packages are made for: `ros_ends.py ROLE`.

They take orders like `bus_ends`, under the same names; the loop is written here again, since that file imports ours.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import rospy
from dynamic_reconfigure import client, server
from geometry_msgs.msg import Twist, Vector3
from std_srvs.srv import SetBool, SetBoolResponse

TWIST = Twist(linear=Vector3(x=0.3), angular=Vector3(z=-1.0))
PATIENCE = 10.0  # [s] for anything to come
QUIET = 0.3  # [s] without a message after which a flood is over
RUNTIME = {
    "name": "runtime",
    "type": "double",
    "default": 45.0,
    "min": 1.0,
    "max": 1e6,
    "level": 0,
    "description": "",
    "edit_method": "",
    "cconsttype": "const double",
}


class Battery:
    """What `dynamic_reconfigure` generates for a node with one parameter."""

    config_description = {
        "name": "Default",
        "type": "",
        "state": True,
        "cstate": "true",
        "id": 0,
        "parent": 0,
        "parameters": [RUNTIME],
        "groups": [],
    }
    min, max, defaults, level = {"runtime": 1.0}, {"runtime": 1e6}, {"runtime": 45.0}, {"runtime": 0}
    type, all_level = {"runtime": "double"}, 0


class Echo:
    """Sends each twist back, answers requests, has a parameter, floods."""

    def __init__(self) -> None:
        rospy.init_node("battery")
        pong = rospy.Publisher("pong", Twist, queue_size=1, tcp_nodelay=True)
        self._kept = (
            rospy.Subscriber("ping", Twist, pong.publish, queue_size=1, tcp_nodelay=True),
            rospy.Service("ask", SetBool, lambda request: SetBoolResponse(success=request.data)),
            server.Server(Battery, lambda config, level: config),
        )

    def flood(self, number: int) -> int:
        """Send `number` twists as fast as a queue takes them."""
        publisher = rospy.Publisher("flood", Twist, queue_size=number)
        while not publisher.get_num_connections():
            time.sleep(0.01)
        for _ in range(number):
            publisher.publish(TWIST)
        self._flooding = publisher
        return number


class Asker:
    """Measures what the others measure."""

    def __init__(self) -> None:
        rospy.init_node("asker")
        self._back, self._at = threading.Event(), 0.0
        self._handled: list[float] = []
        self._ping = rospy.Publisher("ping", Twist, queue_size=1, tcp_nodelay=True)
        self._pong = rospy.Subscriber("pong", Twist, self._note, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("flood", Twist, lambda twist: self._handled.append(time.perf_counter()), queue_size=None)
        rospy.wait_for_service("ask", PATIENCE)
        self._ask = rospy.ServiceProxy("ask", SetBool)
        self._battery = client.Client("battery", timeout=PATIENCE)
        while not self._ping.get_num_connections() or not self._pong.get_num_connections():
            time.sleep(0.01)

    def hop(self, number: int, pause: float) -> list[float]:
        """Return the times of `number` twists there and back [s], with `pause` [s] between two."""
        return [self._there_and_back(pause) for _ in range(number)]

    def ask(self, number: int) -> list[float]:
        """Return the times of `number` requests [s], each over a connection of its own, as is the default."""
        return [_timed(lambda: self._ask(True)) for _ in range(number)]

    def set(self, number: int) -> list[float]:
        """Return the times of setting a parameter `number` times [s]."""
        return [
            _timed(lambda value=value: self._battery.update_configuration({"runtime": 40.0 + value % 10}))  # type: ignore[misc]
            for value in range(number)
        ]

    def count_flood(self, number: int) -> dict[str, float]:
        """Return how many messages per second [Hz] of a flood were handled."""
        self._handled = []
        deadline = time.monotonic() + PATIENCE
        while not self._handled or time.perf_counter() - self._handled[-1] < QUIET:
            if not self._handled and time.monotonic() > deadline:
                raise TimeoutError("there is no flood")
            time.sleep(0.01)
        return {"handled": len(self._handled) / (self._handled[-1] - self._handled[0])}

    def _note(self, twist: Twist) -> None:
        self._at = time.perf_counter()
        self._back.set()

    def _there_and_back(self, pause: float) -> float:
        self._back.clear()
        time.sleep(pause)
        started = time.perf_counter()
        self._ping.publish(TWIST)
        if not self._back.wait(PATIENCE):
            raise TimeoutError("nothing came back")
        return self._at - started


def _timed(job: Callable[[], Any]) -> float:
    started = time.perf_counter()
    job()
    return time.perf_counter() - started


def main(role: str) -> None:
    """Take orders until there are no more."""
    end: Any = {"echo": Echo, "asker": Asker}[role]()
    answer: Any = "ready"
    while True:
        sys.stdout.write(json.dumps(answer) + "\n")
        sys.stdout.flush()
        line = sys.stdin.readline()
        if not line:
            raise SystemExit
        method, *arguments = json.loads(line)
        answer = getattr(end, method)(*arguments)


if __name__ == "__main__":
    main(sys.argv[1])
