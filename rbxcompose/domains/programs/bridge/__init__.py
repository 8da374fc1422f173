"""The bridge to a ROS 2 with other middleware: bytes go through a socket to a process of its own Python."""
