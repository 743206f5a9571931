"""The camera's view, and lines upon it."""
