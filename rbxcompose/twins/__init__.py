"""Simulated devices that answer as real ones do: servos, as memory, on a line, and behind a pseudo-terminal."""
