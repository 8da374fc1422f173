"""Topics, services and actions, in the process and over Zenoh."""
