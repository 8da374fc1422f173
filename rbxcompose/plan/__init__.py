"""From a checked robot to the plan of what will run: frozen, sorted, independent of the manifest's language."""
