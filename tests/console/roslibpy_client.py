"""What a user of roslibpy does, in a process of its own: its reactor cannot be started twice. Prints JSON."""

from __future__ import annotations

import json
import sys
import threading
from typing import Any

import roslibpy

PATIENCE = 10.0  # [s]


def main(port: int) -> None:
    """Subscribe, publish and call; print what came."""
    client = roslibpy.Ros("127.0.0.1", port)
    client.run(timeout=PATIENCE)
    told: dict[str, Any] = {"topics": client.get_topics(), "type": client.get_topic_type("/odom")}
    told["time"] = dict(client.get_time())
    got, has_come = [], threading.Event()

    def arrived(message: dict[str, Any]) -> None:
        got.append(message)
        has_come.set()

    odometry = roslibpy.Topic(client, "/odom", "nav_msgs/Odometry", throttle_rate=100)
    odometry.subscribe(arrived)
    chatter = roslibpy.Topic(client, "/chatter", "std_msgs/String")
    has_echo = threading.Event()
    echo: list[str] = []

    def echoed(message: dict[str, Any]) -> None:
        echo.append(message["data"])
        has_echo.set()

    chatter.subscribe(echoed)
    chatter.publish(roslibpy.Message({"data": "grüße"}))
    assert has_come.wait(PATIENCE)
    assert has_echo.wait(PATIENCE)
    service = roslibpy.Service(client, "/base/get_parameters", "rcl_interfaces/GetParameters")
    told["parameters"] = service.call(roslibpy.ServiceRequest({"names": ["max_speed"]}), timeout=PATIENCE).data
    lease = roslibpy.Service(client, "/console/drive", "console/Drive")
    told["lease"] = lease.call(roslibpy.ServiceRequest({"take": True, "name": "roslibpy"}), timeout=PATIENCE).data
    roslibpy.Topic(client, "/cmd_vel/teleop", "geometry_msgs/Twist").publish(
        roslibpy.Message({"linear": {"x": 0.2, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}})
    )
    failed = roslibpy.Service(client, "/nothing", "std_srvs/Empty")
    try:
        failed.call(roslibpy.ServiceRequest(), timeout=PATIENCE)
    except roslibpy.core.ServiceException as error:
        told["failure"] = str(error)
    told |= {"odometry": got[0]["child_frame_id"], "echo": echo[0]}
    client.terminate()
    print(json.dumps(told))  # noqa: T201 - this is what the test reads


if __name__ == "__main__":
    main(int(sys.argv[1]))
