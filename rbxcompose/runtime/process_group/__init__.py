"""One process of a robot: its components, its end of the bus, its loop."""
