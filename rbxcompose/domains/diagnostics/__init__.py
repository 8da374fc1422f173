"""Diagnostics: the tree of statuses, monitors, thresholds."""

IN_EVERY_ROBOT = True  # it has a component that runs in all of them
