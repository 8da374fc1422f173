"""Sections of manifests about worlds."""
