"""The line laser: its sheet, and the irradiance it makes."""
