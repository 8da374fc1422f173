"""The domains of a robot: each is a folder with all that belongs to it."""
