"""Batteries and charging."""
