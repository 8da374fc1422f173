"""Navigation: maps with costs, ways through them, and following these."""
