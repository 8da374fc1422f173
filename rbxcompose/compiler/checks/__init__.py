"""Rules about the whole robot that belong to no domain."""
