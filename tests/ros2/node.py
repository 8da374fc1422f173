"""A node of ROS 2 as somebody else would write it; it runs in ROS's own Python."""

from __future__ import annotations

import sys
import time
from typing import Any

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci
from test_msgs.msg import Builtins

SPEED, PERIOD = 0.2, 0.05  # [m/s], [s]


class OtherNode(Node):  # type: ignore[misc]  # rclpy is not here
    """Drives, answers, counts, and says what it has heard."""

    def __init__(self) -> None:
        super().__init__("somebody")
        self.declare_parameter("gain", 0.25)
        self.group = ReentrantCallbackGroup()
        self.odometry = 0
        self.commands = self.create_publisher(Twist, "cmd_vel_ros", 10)
        self.heard = self.create_publisher(String, "heard", 10)
        self.answers = self.create_publisher(Builtins, "answered", 10)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.plan = self.create_publisher(String, "plan", latched)
        self.plan.publish(String(data="the only one"))
        self.create_subscription(Odometry, "odom", self.on_odometry, 10)
        self.create_subscription(Builtins, "asked", self.answers.publish, 10)
        self.create_subscription(Builtins, "uptime", self.create_publisher(Builtins, "uptime_seen", 10).publish, 10)
        self.create_service(Trigger, "beep", self.beep)
        self.create_service(Trigger, "retune", self.retune, callback_group=self.group)
        self.create_service(Trigger, "chase", self.chase, callback_group=self.group)
        self.speeds = self.create_client(SetParameters, "/go_to/set_parameters", callback_group=self.group)
        self.ours = ActionClient(self, Fibonacci, "ours", callback_group=self.group)
        ActionServer(
            self,
            Fibonacci,
            "count",
            self.count,
            callback_group=self.group,
            cancel_callback=lambda goal: CancelResponse.ACCEPT,
        )
        self.create_timer(PERIOD, self.drive)

    def drive(self) -> None:
        command = Twist()
        command.linear.x = SPEED
        self.commands.publish(command)

    def on_odometry(self, message: Odometry) -> None:
        self.odometry += 1

    def beep(self, request: Any, response: Any) -> Any:
        gain = self.get_parameter("gain").value
        response.success, response.message = True, f"{self.odometry > 0} {gain}"
        return response

    async def retune(self, request: Any, response: Any) -> Any:
        value = ParameterValue(type=3, double_value=0.25)
        answer = await self.speeds.call_async(SetParameters.Request(parameters=[Parameter(name="speed", value=value)]))
        response.success, response.message = answer.results[0].successful, answer.results[0].reason
        return response

    def count(self, goal: Any) -> Any:
        found = [0, 1]
        for _ in range(goal.request.order):
            if goal.is_cancel_requested:
                goal.canceled()
                return Fibonacci.Result(sequence=found)
            found.append(found[-1] + found[-2])
            goal.publish_feedback(Fibonacci.Feedback(sequence=found))
            time.sleep(PERIOD)
        goal.succeed()
        return Fibonacci.Result(sequence=found)

    async def chase(self, request: Any, response: Any) -> Any:
        goal = await self.ours.send_goal_async(Fibonacci.Goal(order=3))
        result = (await goal.get_result_async()).result
        response.success, response.message = goal.accepted, str(list(result.sequence))
        return response


def main() -> None:
    """Spin until it is interrupted."""
    rclpy.init(args=sys.argv)
    executor = SingleThreadedExecutor()  # one of several threads keeps a processor busy
    executor.add_node(OtherNode())
    try:
        executor.spin()
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        return


if __name__ == "__main__":
    main()
