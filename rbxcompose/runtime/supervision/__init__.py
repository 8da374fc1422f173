"""How a robot is led: the supervisor, what it decides, and the processes that it has forked."""
