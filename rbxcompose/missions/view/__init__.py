"""What viewers see of a mission: its picture, and how it changes while it runs."""
