"""Missions: their pictures, live or from files, their logs, what could happen to them."""
