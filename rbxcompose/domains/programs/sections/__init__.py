"""Sections of the manifest about programs of others."""
