"""A line estimated along itself, steps and corners kept."""
