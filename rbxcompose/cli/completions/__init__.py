"""What may come at the end of a command line."""
