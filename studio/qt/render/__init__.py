"""Rendering, developing and motion panels."""
