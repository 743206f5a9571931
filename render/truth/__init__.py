"""The exact line and the truth of each pixel."""
