"""Programs of others: executables, containers and ROS 2 nodes as components."""
