"""An example of each section of a manifest; a test compiles it within the patrol robot."""

from __future__ import annotations

from collections.abc import Mapping

SECTIONS: Mapping[str, str] = {
    "args": """
args:
  speed:
    type: speed
    default: 0.3 m/s
    min: 5 cm/s
    max: 0.5 m/s
    about: Speed between places.
""",
    "include": """
include:
  lift:
    part: rbx:parts/battery.yaml
    with:
      dock: dock
      runtime: 90 s
    connect:
      battery_level: lift/battery_level
      set_battery_level: lift/set_battery_level
      recharge: recharge_lift
""",
    "body": """
body:
  urdf: robot.urdf                # beside this file, or a path from here
""",
    "components": """
components:
  base:
    type: diff_drive_sim
    max_speed: 0.5 m/s            # a setting of the type
    connect:
      odom: wheels/odom           # its port `odom` writes on this topic
  go_to:
    type: go_to
    process: driving
    starts_after: [base]
""",
    "muxes": """
muxes:
  cmd_vel:
    inputs:
      teleop:
        priority: 100
        timeout: 0.5 s
      navigation:
        from: go_to
        priority: 10
        timeout: 0.5 s
    locks:
      door:
        priority: 200
        timeout: 0.3 s
""",
    "diagnostics": """
diagnostics:
  analyzers:
    power:
      match: [battery, charger*]
      timeout: 5 s
      expected: [charger]
""",
    "places": """
places:
  window: {x: 2 m, y: -50 cm, heading: 90 deg, colour: blue}
""",
    "values": """
values:
  battery: battery.battery_level
  door:
    topic: door/state
    type: text
""",
    "missions": """
missions:
  patrol:
    file: ../../missions/patrol.yaml
    with:
      rounds: 3
""",
    "bus": """
bus:
  domain: 7
  namespace: robot_1
  port: 7447
""",
    "start": """
start: patrol
""",
    "profiles": """
profiles:
  tired:
    components:
      battery:
        runtime: 30 s
    start: !remove
""",
}

PART = """
rbx: 1
kind: Part
name: follower
about: Drives to where somebody else goes.

components:
  driver:
    type: go_to
    connect:
      go_to: follow

muxes:
  cmd_vel:
    inputs:
      follower:
        from: driver
        priority: 50
        timeout: 0.5 s

needs:
  ports:
    cmd_vel: geometry_msgs/Twist
provides:
  skills: [follow]
"""

OVERLAY = """
rbx: 1
kind: Overlay
name: garden
about: Slower, and with another dock.

args:
  speed: 0.2 m/s
places:
  dock: !replace {x: 2 m, y: 0 m}
"""
