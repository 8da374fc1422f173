"""Servos: control tables of models, serial ports, and the buses on which servos are read and written."""
