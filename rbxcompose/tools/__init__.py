"""Verbs that belong to no domain, and tools around robots: editors, doctor, inspection, tests of missions."""
