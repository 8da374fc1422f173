"""A server for clients of the Model Context Protocol: verbs as tools, within a project and with a log of all calls."""
