"""Looks at this machine and at robots that run on it: what keeps them from running well, and what to do about it."""
