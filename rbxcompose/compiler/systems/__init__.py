"""Robots on several hosts."""
