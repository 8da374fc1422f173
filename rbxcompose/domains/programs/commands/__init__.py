"""Verbs about programs of others."""
