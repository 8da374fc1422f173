"""Components that read devices at USB and serial ports."""
