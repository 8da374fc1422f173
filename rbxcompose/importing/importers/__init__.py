"""Importers, one file each, by the name of the program whose files they read."""
