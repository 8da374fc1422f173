"""Kinds of findings about systems that are reported while they are read."""

from __future__ import annotations

from rbxcompose.findings import kind

UNKNOWN_HOST = kind(
    "RBX6100",
    """Unknown host

`on` and `place` take the name of a host of the system, or a label that at least one host has.

Bad:
```yaml
hosts:
  desk: {}
robots:
  turtlebot:
    robot: ../robots/turtlebot/robot.yaml
    on: dest
```
Good:
```yaml
    on: desk
```
""",
    is_fixable=True,
)
NOTHING_TO_PLACE = kind(
    "RBX6101",
    """Nothing of this name can be placed

The keys of `place` are components of the robot, muxes and missions among them, as `plan` lists them, or parts that it
includes.

Bad:
```yaml
    place: {bas: robot}
```
Good:
```yaml
    place: {base: robot}
```
""",
    is_fixable=True,
)
SAME_NAME = kind(
    "RBX6131",
    """Two robots have one name

The instances of a robot are NAME_1, NAME_2 and so on. No other robot of the system can have one of these names.

Bad:
```yaml
robots:
  scout: {robot: ../robots/scout/robot.yaml, instances: 3}
  scout_2: {robot: ../robots/other/robot.yaml}
```
Good:
```yaml
  other: {robot: ../robots/other/robot.yaml}
```
""",
)
BROKEN_ROBOT = kind(
    "RBX6102",
    """A robot of the system has errors

Findings of the robot itself are reported with it. `check` the robot alone for the same findings.

Bad: a system with a robot that `rbxcompose check` refuses.
Good: `rbxcompose check robots/turtlebot` finds no error, then `rbxcompose check systems/two_hosts.yaml`.
""",
)
