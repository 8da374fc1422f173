"""A lamp: what somebody else's package for rbxcompose looks like."""
