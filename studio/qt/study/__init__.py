"""The Study workspace: put a study together, run it, see what it finds."""
