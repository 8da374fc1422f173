"""Simulated servos that answer as real ones do."""
