"""Controllers: what leads joints, one file each."""
