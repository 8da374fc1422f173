"""Triggers: what starts missions by itself."""
