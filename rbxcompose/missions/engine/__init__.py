"""The engine that runs a mission: pure, told the time."""
