"""What runs a plan: supervisor, process groups, recording, replay."""
