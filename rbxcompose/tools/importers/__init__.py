"""Importers that belong to no domain."""
