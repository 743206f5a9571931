"""Which candidate is the line: continuity along it, and geometry of the working volume."""
