"""Muxes: who may command."""
