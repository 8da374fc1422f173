"""What monitors of this computer share: how they read it, and how they judge it."""
