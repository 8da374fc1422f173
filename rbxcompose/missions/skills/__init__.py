"""Skills in Python, a file each."""
