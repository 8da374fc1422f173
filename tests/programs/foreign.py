"""A robot whose base is a program that knows nothing but Zenoh."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import yaml

BARE_BASE = [sys.executable, str(Path(__file__).with_name("bare_base.py"))]
PATROL = "rbx: 1\nkind: Mission\nname: patrol\ndo: [{go_to: a}, {go_to: b}]\n"


def base(**changes: Any) -> dict[str, Any]:
    """Return the component that runs the program."""
    drives = {"odometry": "odom", "max_speed": "0.5 m/s", "max_turn_rate": "90 deg/s", "acceleration": "1 m/s^2"}
    return {
        "type": "program",
        "command": BARE_BASE,
        "subscribes": {"cmd_vel": "geometry_msgs/Twist"},
        "publishes": {
            "odom": {"type": "nav_msgs/Odometry", "rate": "50 Hz"},
            "/tf": {"type": "tf2_msgs/TFMessage", "rate": "50 Hz"},
        },
        "ready": {"topic": "odom"},
        "capabilities": {"frames": {"base_footprint": "odom"}, "drives": {**drives, "stops_after": "0.5 s"}},
        **changes,
    }


def patrol(name: str, **changes: Any) -> str:
    """Return a robot that patrols with it, as text; `changes` are of the base."""
    places = {"a": {"x": "0.5 m", "y": "0 m", "heading": "90 deg"}, "b": {"x": "0 m", "y": "0 m", "heading": "180 deg"}}
    navigation = {"from": "go_to", "priority": 10, "timeout": "0.5 s"}
    sections = {
        "places": places,
        "components": {"base": base(**changes), "go_to": {"type": "go_to", "speed": "0.4 m/s"}},
        "muxes": {"cmd_vel": {"inputs": {"navigation": navigation}}},
        "missions": {"patrol": "patrol.yaml"},
        "start": "patrol",
    }
    return robot(name, **sections)


def robot(name: str, **sections: Any) -> str:
    """Return a robot with some sections, as text."""
    return yaml.safe_dump({"rbx": 1, "kind": "Robot", "name": name, **sections}, sort_keys=False)
