"""Random numbers by counter, low-discrepancy points, Poisson counts."""
