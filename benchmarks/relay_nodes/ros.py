#!/usr/bin/python3
"""A relay as a node of ROS 1: `ros.py NUMBER FOLDER`."""

from __future__ import annotations

import sys

import rospy
from geometry_msgs.msg import Twist

from benchmarks.relay_nodes.mark import mark


def main(number: int, folder: str) -> None:
    """Pass messages on until the node is to end; the first in the row makes them."""
    rospy.init_node(f"relay_{number}")
    told = rospy.Publisher(f"link_{number + 1}", Twist, queue_size=1)
    marked: list[int] = []

    def heard(message: Twist) -> None:
        told.publish(message)
        if not marked:
            marked.append(number)
            mark(folder, number)

    if number:
        rospy.Subscriber(f"link_{number}", Twist, heard, queue_size=1, tcp_nodelay=True)
        rospy.spin()
        return
    rate = rospy.Rate(100)
    while not rospy.is_shutdown():
        heard(Twist())
        rate.sleep()


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2])
