"""Servos: buses, models, joints, controllers, simulated twins."""

RULES_ABOUT = ("LocksInSilence",)  # of muxes, which may come as late as what protects servos
