"""The kinds of mission nodes: one file each, which defines how it is read and how it runs."""
