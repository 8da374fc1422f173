"""Pure cores of the simulated world: the twins of drivers and what they measure."""
