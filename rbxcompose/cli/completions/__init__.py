"""What may stand at the end of a command line."""
