"""Skills in Python that ship with the project, one file each."""
