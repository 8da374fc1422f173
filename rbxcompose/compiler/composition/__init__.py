"""From the files of a robot to one manifest."""
