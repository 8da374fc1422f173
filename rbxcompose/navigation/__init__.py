"""Pure cores that drive a base to a goal."""
