"""From a checked robot to the plan of what will run: frozen, sorted, free of the manifest's language."""
