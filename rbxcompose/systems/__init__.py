"""Robots on several hosts: which host runs what, what crosses between them, and how they are linked."""
