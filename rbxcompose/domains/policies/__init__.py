"""Policies: networks of the user that command joints or the base."""
