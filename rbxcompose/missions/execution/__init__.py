"""Missions on a running robot."""
