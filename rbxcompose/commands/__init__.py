"""The frame of the command line: output, finding a robot, a guest on its bus, new files."""
