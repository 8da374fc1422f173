"""What `servo` does: looks for servos, reads and writes them, by their ids on a port and without any manifest."""
