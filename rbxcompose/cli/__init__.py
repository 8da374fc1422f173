"""The command line: one file per verb, and packages with what they share."""
