"""Files of a project: which robots they make, their fixes, one more mission."""
