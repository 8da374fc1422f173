"""The engine that runs a mission: pure, with time as an argument."""
