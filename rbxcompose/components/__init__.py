"""Component types, one file each: thin shells that connect a pure core to the bus."""
