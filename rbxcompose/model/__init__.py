"""The whole robot as one typed value: what the checks look at and the plan is made from."""
