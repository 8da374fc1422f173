"""Modifiers: settings that any mission node may have, each a task around the task of the node."""
