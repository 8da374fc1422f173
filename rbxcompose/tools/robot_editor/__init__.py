"""The editor of robots: places, muxes and parts changed as texts."""
