"""Recordings: receiving and sending messages, options, and the replay of one component."""
