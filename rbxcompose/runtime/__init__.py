"""Running a plan: scheduler, component host, process groups and their supervisor."""
