"""Formats of findings, one file each. Pure: nothing is printed here."""
