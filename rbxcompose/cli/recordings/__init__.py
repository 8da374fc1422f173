"""Recordings: what takes and sends messages, options, one component run again."""
