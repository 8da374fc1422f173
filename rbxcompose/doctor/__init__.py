"""Examines this machine and the robots on it: what keeps them from running well, and what to do about it."""
