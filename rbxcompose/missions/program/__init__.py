"""Missions as they are read: nodes, kinds and modifiers, and the questions these answer."""
