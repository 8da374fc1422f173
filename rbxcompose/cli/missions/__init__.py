"""Missions: their pictures, live or from files, their logs, and their exploration."""
