"""Devices on USB: what is plugged in, by the kernel's lists below a root folder, which one is meant, and udev rules."""
