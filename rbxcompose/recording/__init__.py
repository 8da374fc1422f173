"""Recordings: topics of a robot in MCAP files, written so that a crash loses half a second, and read with distrust."""
