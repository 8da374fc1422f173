"""What runs in ROS's own Python for the benchmark of the bridge: `python programs_ends.py ROLE`."""

import json
import os
import signal
import sys
import time
from typing import Any

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Image

TRIPS, PAUSE = 300, 0.01  # round trips by each way, and [s] between two
RATE, IMAGES = 1000.0, 20.0  # [Hz]


def _ping(node: Any) -> None:
    """Print the round trips [s] by both ways, taken in turns."""
    arrived = {"bridge": 0.0, "peer": 0.0}

    def hear(way: str, message: Odometry) -> None:
        arrived[way] = message.twist.twist.linear.x

    senders = {way: node.create_publisher(Twist, f"{way}_cmd", 1) for way in arrived}
    for way in arrived:
        node.create_subscription(Odometry, f"{way}_odom", lambda message, way=way: hear(way, message), 1)
    took: dict[str, list[float]] = {way: [] for way in arrived}
    deadline, number = time.monotonic() + 60.0, 0
    while min(map(len, took.values())) < TRIPS and time.monotonic() < deadline:
        number += 1
        for way, sender in senders.items():
            message = Twist()
            message.linear.x = float(number)
            began = time.perf_counter()
            sender.publish(message)
            while arrived[way] != number and time.perf_counter() - began < 0.5:
                rclpy.spin_once(node, timeout_sec=0.1)
            if arrived[way] == number:
                took[way].append(time.perf_counter() - began)
            time.sleep(PAUSE)
    sys.stdout.write(json.dumps(took))


def _echo(node: Any) -> None:
    """Answer each velocity with odometry."""
    sender = node.create_publisher(Odometry, "peer_odom", 1)

    def answer(message: Twist) -> None:
        odometry = Odometry()
        odometry.twist.twist = message
        sender.publish(odometry)

    node.create_subscription(Twist, "peer_cmd", answer, 1)
    rclpy.spin(node)


def _flood(node: Any, message: Any, topic: str, rate: float) -> None:
    """Publish at a rate until the process is ended."""
    sender = node.create_publisher(type(message), topic, 10)
    due = time.monotonic()
    while rclpy.ok():
        due += 1 / rate
        sender.publish(message)
        time.sleep(max(0.0, due - time.monotonic()))


def main() -> None:
    """Play a role."""
    role = sys.argv[1]
    signal.signal(signal.SIGTERM, lambda number, frame: os._exit(0))
    rclpy.init()
    node = rclpy.create_node(role)
    match role:
        case "ping":
            _ping(node)
        case "echo":
            _echo(node)
        case "flood":
            _flood(node, Twist(), "flood", RATE)
        case "images":
            image = Image(width=640, height=480, encoding="rgb8", step=1920, data=bytes(640 * 480 * 3))
            _flood(node, image, "images", IMAGES)
    sys.stdout.flush()
    os._exit(0)


main()
