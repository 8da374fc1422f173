"""Launch files of ROS 2: three languages that become the same entities, and what these start."""
