"""Where in the pixels the line is: one estimator a file."""
