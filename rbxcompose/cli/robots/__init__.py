"""Robots that run: which one is meant, what it is asked, how it is watched and changed."""
