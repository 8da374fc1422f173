"""An example of a part and of an overlay; those of the sections stand with their descriptors."""

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
