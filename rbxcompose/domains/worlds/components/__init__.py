"""What is in a simulated world, and what sees it."""
