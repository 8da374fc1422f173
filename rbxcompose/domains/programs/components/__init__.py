"""Types of components that run programs of others."""
