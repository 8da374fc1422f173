"""The sections of robots, parts and overlays: one file each."""
