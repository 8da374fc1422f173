"""Topics, services and actions: by reference within a process, over Zenoh as ROS 2 puts them between processes."""
