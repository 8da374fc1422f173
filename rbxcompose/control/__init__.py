"""Pure cores of what moves: joints and their limits, trajectories, grippers, bases on wheels."""
