"""Importers of files that start programs."""
