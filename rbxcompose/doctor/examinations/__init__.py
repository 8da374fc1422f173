"""Examinations: one file each, named like its function."""
