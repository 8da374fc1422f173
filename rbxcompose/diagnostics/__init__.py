"""Pure core of the robot's diagnostics: levels, statuses and the aggregated tree."""
