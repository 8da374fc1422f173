from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription, OpaqueFunction, RegisterEventHandler, TimerAction
from launch.event_handlers import OnProcessExit
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import Command, LaunchConfiguration, ThisLaunchFileDir
from launch_ros.actions import ComposableNodeContainer, LifecycleNode, Node
from launch_ros.descriptions import ComposableNode, ParameterValue
from nav2_common.launch import RewrittenYaml


def nothing(context, *, wanted):
    assert wanted
    return []


def generate_launch_description():
    spawner = Node(package="controller_manager", executable="spawner", arguments=["arm"], name="spawner")
    state = Node(
        package="robot_state_publisher",
        executable="robot_state_publisher",
        output="both",
        on_exit=[],
        parameters=[{"robot_description": ParameterValue(Command(["xacro ", "robot.xacro"]), value_type=str)}],
    )
    container = ComposableNodeContainer(
        name="container",
        namespace="",
        package="rclcpp_components",
        executable="component_container",
        composable_node_descriptions=[ComposableNode(package="demo", plugin="demo::Talker", name="talker")],
    )
    description = LaunchDescription([state, container])
    description.add_action(RegisterEventHandler(OnProcessExit(target_action=state, on_exit=[spawner])))
    description.add_action(TimerAction(period=2.0, actions=[Node(package="a", executable="b")]))
    description.add_action(LifecycleNode(package="c", executable="d", name="d", namespace="x"))
    description.add_action(OpaqueFunction(function=nothing, kwargs={"wanted": True}))
    rewritten = RewrittenYaml(source_file="nav2.yaml", param_rewrites={}, convert_types=True)
    description.add_action(Node(package="e", executable="f", parameters=[rewritten, {"g": LaunchConfiguration("h")}]))
    source = PythonLaunchDescriptionSource([ThisLaunchFileDir(), "/in_python.launch.py"])
    description.add_action(
        IncludeLaunchDescription(source, launch_arguments={"port": "/dev/ttyUSB7", "with_camera": "true"}.items())
    )
    return description
