"""Programs beside the components: nodes of ROS 2, and any other program, which the robot starts."""
