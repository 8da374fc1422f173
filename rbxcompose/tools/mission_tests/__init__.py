"""Mission tests."""
