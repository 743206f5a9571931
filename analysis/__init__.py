"""What the images tell: line extraction, triangulation, error, report."""
