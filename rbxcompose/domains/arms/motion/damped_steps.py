"""How a descent by damped least squares goes on and when it is stuck; plain and compiled code share it."""

LEAST_DAMPING, DAMPING = 1e-6, 1e-2  # the second one times the square of the error
LONGEST = 1.0  # [rad or m] that a joint moves in one iteration, at most
PATIENCE, PROGRESS = 4, 0.8  # iterations without the error's square shrinking to this share, which end a descent
