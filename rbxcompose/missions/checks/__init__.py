"""Rules about missions: a module for each subject."""
