"""Missions on a running robot: what they ask of it is done, several run beside each other, all can be watched."""
