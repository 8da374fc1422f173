"""Devices on USB and serial ports."""
