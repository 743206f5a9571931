"""From values for red, green and blue to a value at one wavelength."""

from __future__ import annotations

Bands = tuple[float, float, float]
"""Three wavelengths, nm: those of the colour bands, or thrice a laser's."""

BAND_CENTRES_NM = (610.0, 545.0, 465.0)
"""Wavelengths, nm, at which the red, green and blue values of an albedo hold."""


def per_band(value: float | tuple[float, float, float]) -> tuple[float, float, float]:
    """R, G, B of a value that is given as such, or as one number for all three."""
    return value if isinstance(value, tuple) else (value, value, value)


def at_wavelength(rgb: tuple[float, float, float], wavelength_nm: float) -> float:
    """An RGB value interpolated at one wavelength."""
    return sum(weight * value for weight, value in zip(reflectance_weights(wavelength_nm), rgb, strict=True))


def reflectance_weights(wavelength_nm: float) -> tuple[float, float, float]:
    """Weights of (R, G, B) that interpolate an RGB albedo linearly at one wavelength, constant beyond the bands."""
    red, green, blue = BAND_CENTRES_NM
    if wavelength_nm >= red:
        return 1.0, 0.0, 0.0
    if wavelength_nm >= green:
        t = (wavelength_nm - green) / (red - green)
        return t, 1.0 - t, 0.0
    if wavelength_nm >= blue:
        t = (wavelength_nm - blue) / (green - blue)
        return 0.0, t, 1.0 - t
    return 0.0, 0.0, 1.0
