"""Files of a project: the robots that they make, their fixes, new missions."""
