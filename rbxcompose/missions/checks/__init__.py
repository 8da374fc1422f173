"""Rules about missions: one file each, with its docs page."""
