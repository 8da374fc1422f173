"""The language of missions: the places of its grammar, and reading a located tree into a program."""
