"""Muxes: who may command."""

RULES_ABOUT = ("every robot",)  # in which two components may write one topic without a mux
