"""Missions: read into a program, checked against a robot, run by a pure engine that takes time as an argument."""
