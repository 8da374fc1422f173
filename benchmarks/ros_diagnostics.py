"""A robot of ROS 1 that reports to its aggregator, run by the Python of its packages: `ros_diagnostics.py ITEMS PARTS`.

`bench_diagnostics` measures the aggregator meanwhile.
"""

from __future__ import annotations

import sys

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

RATE = 10  # [Hz]
VALUES = {"rate": "10.02 Hz", "temperature": "41.5 degC", "errors": "0"}


def main(items: int, parts: int) -> None:
    """Report until it is ended."""
    rospy.init_node("robot")
    publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
    values = [KeyValue(key, value) for key, value in VALUES.items()]
    statuses = [
        DiagnosticStatus(0, f"part_{index % parts}: item {index}", "works as it should", f"hardware {index}", values)
        for index in range(items)
    ]
    rate = rospy.Rate(RATE)
    while not rospy.is_shutdown():
        message = DiagnosticArray(status=statuses)
        message.header.stamp = rospy.Time.now()
        publisher.publish(message)
        rate.sleep()


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
