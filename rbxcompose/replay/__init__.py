"""Repeat a recorded run: give one component its recorded inputs and compare its outputs with the recorded ones."""
