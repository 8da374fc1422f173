"""The language of missions: places of its grammar, and from the located tree to a program."""
