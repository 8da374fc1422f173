"""The subcommands of `udev`, one file each, and what they share."""
