"""Running robots: which one is addressed, requests to it, watching it, and changing it."""
