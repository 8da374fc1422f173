"""Bus types."""
