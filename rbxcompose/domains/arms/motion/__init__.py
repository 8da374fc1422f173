"""The core of arms: no bus, no clock. Only modules `compiled_*` need numba."""
