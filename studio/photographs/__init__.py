"""The same for photographs of a real scanner."""
