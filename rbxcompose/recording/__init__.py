"""Recordings: topics in MCAP files, written so that a crash loses at most half a second, and read defensively."""
