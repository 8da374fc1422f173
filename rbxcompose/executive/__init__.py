"""Missions on a running robot: carries out their requests; several run side by side, all can be watched."""
