"""Sections of manifests about navigation."""
