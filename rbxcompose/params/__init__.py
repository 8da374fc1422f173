"""Parameters as ROS 2 knows them, made from the configuration of a component."""
