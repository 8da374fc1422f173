"""Rules about the whole robot, one file each."""
