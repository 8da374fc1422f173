"""What the verbs of `param` do with the settings of a robot that runs."""
