"""Verbs that belong to no domain, a file each."""
