"""What verbs do with the file of a system."""
