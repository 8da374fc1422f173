"""Servos: buses, models, joints, controllers, simulated twins."""
