"""MCAP files: writes, reads and recovers them."""
