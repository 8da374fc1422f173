"""What can be known about a mission before it runs."""
