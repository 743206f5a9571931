"""Calibration of camera and lasers from views of a flat board, with its own uncertainty."""
