"""How a robot is supervised: the supervisor, its decisions, and the processes that it has forked."""
