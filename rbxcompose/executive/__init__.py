"""Missions on a running robot: carries out their requests, runs several side by side, and lets viewers watch all."""
