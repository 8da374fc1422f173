"""The typed model of a whole robot."""
