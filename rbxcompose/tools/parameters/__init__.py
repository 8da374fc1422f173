"""What `param` does."""
