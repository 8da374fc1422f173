"""Bases: wheels, driving to places, emergency stop."""
