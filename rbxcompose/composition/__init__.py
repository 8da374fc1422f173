"""From the files of a robot to one manifest: parts, profiles, overlays, `--set`; every value keeps its origin."""
