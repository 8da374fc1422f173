"""Beside a real ROS 2: rclpy with Fast DDS, in the environment that `make ros2` installs."""
