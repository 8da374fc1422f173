"""What can be known of a mission before it runs."""
