"""Pure cores that drive a base to where it is wanted."""
