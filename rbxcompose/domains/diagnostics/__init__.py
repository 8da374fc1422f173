"""Diagnostics: the tree of statuses, monitors, thresholds."""
