"""The Calibrate workspace: photographs of a board, or virtual ones, to a calibration that tells how good it is."""
