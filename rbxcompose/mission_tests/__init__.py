"""Tests of missions: reading, running in virtual time, judging; the paths that no test took; exploration."""
