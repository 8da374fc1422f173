"""ROS 2 messages, services and actions: definitions, generated classes, type hashes and the CDR codec."""
