"""What the console's page needs to edit missions: a process that reads, checks, changes and saves their texts."""
