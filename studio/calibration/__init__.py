"""Calibration from photographs and in silico: files, boards to print, the calibration file, exchange with others."""
