"""Counter-based random numbers, low-discrepancy points, Poisson counts."""
