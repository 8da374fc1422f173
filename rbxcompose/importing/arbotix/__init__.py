"""Files of `arbotix_python`, the ROS driver of the ArbotiX board and of Dynamixel servos, become manifests."""
