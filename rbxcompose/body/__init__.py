"""The body of a robot: its frames and where they are."""
