"""Inspecting a robot before it runs: composed, value by value, as a diagram, as a plan. Values in, text out."""
