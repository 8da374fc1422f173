"""What knows no robot: units, geometry, time, findings, expressions, files."""
