"""The whole robot as one typed value: the subject of the checks and the source of the plan."""
