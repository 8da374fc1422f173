"""Pure core of command muxes: which of several sources of commands is let through."""
