import os

from launch import LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    GroupAction,
    OpaqueFunction,
    SetEnvironmentVariable,
    SetLaunchConfiguration,
)
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, ThisLaunchFileDir
from launch_ros.actions import Node, PushRosNamespace


def lidar(context):
    place = LaunchConfiguration("place").perform(context)
    return [
        Node(
            package="rplidar_ros",
            executable="rplidar_composition",
            name="lidar_node",
            namespace=place,
            respawn=True,
            respawn_delay=2.0,
            parameters=[
                {
                    "serial_port": LaunchConfiguration("port"),
                    "a.b": 3,
                    "filter": {"range": 3.0, "names": ["low", "high"], "code": "3"},
                }
            ],
            remappings=[("scan", f"{place}/scan")],
        )
    ]


def generate_launch_description():
    with_camera = LaunchConfiguration("with_camera")
    base = Node(
        package="base_driver",
        executable="driver",
        arguments=["--baud", "115200"],
        parameters=[PathJoinSubstitution([ThisLaunchFileDir(), "config", "base.yaml"])],
        additional_env={"DEBUG": "1"},
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument("port", default_value="/dev/ttyUSB1", description="where the lidar is"),
            DeclareLaunchArgument("with_camera", default_value="false"),
            DeclareLaunchArgument("headless", default_value="true"),
            SetLaunchConfiguration("place", "front"),
            OpaqueFunction(function=lidar),
            GroupAction(
                [PushRosNamespace("base"), SetEnvironmentVariable("ROBOT", "cart"), base],
                condition=UnlessCondition(with_camera),
            ),
            Node(package="camera", executable="camera_node", condition=IfCondition(with_camera)),
            Node(package="rviz2", executable="rviz2", condition=UnlessCondition(LaunchConfiguration("headless"))),
            ExecuteProcess(cmd=[os.path.join(".", "watch"), "--every", "5"], cwd="tools", name="watcher"),
        ]
    )
