"""Topics, services and actions: by reference within a process, between processes over Zenoh in the format of ROS 2."""
