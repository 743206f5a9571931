"""Lines of any direction, as points with their normal."""
