"""Motions of arms: planned on the body's real geometry, verified, and timed within the limits of joints."""
