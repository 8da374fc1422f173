"""Worlds: what stands around a simulated robot, what its rays hit and where it touches."""
