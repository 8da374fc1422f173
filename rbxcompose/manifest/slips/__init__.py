"""Beginners' slips in manifests, by what they repair."""
