"""Types of buses of servos, one file each."""
