"""Tests of missions: read, run in virtual time, judged; which ways of a mission no test took; what could happen."""
