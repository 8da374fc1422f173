"""Sections of a manifest that belong to no domain, a file each."""
