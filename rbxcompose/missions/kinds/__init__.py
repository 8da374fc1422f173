"""The kinds of mission nodes: a file for each subject, which defines how they are read and how they run."""
