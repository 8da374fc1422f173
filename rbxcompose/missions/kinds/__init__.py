"""The kinds of mission nodes: one file each, with how it is read and how it runs."""
