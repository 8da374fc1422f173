"""What gives a robot its map, and drives it through that."""
