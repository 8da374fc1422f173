"""A recorded run again: one component gets its recorded inputs, its outputs are compared with those of then."""
