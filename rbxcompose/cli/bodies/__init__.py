"""The actions of `body`, one file each, and what they share."""
