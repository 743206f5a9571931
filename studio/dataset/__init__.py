"""Labelled images by the thousand."""
