"""Colours: what a wavelength looks like on a screen, and the one colour that each thing keeps throughout a report."""

from __future__ import annotations

import math
from typing import get_args

from analysis.line.settings import Method

INK, MUTED, GRID, PAPER = "#1c2733", "#67737f", "#e2e6ea", "#ffffff"
ACCENT = "#0b6e8a"
TRUTH = "#2ba8dc"
STEEL = "#aeb8c2"
"""Surfaces in the 3D pictures."""
SLATE = "#59646f"
"""The same under points coloured by their error: darker, so that white, the colour of no error, stands out."""
DIVERGING = "RdBu_r"
"""Red and blue about white: told apart by every common colour vision (ColorBrewer)."""

# Okabe & Ito (2008), chosen to be told apart by every common colour vision
METHODS = {"likelihood": "#d55e00", "gaussian": "#8a5aa8", "centre_of_mass": "#009e73"}
OTHERS = (
    "#b58900", "#c2438f", "#7a5230", "#3d5a80", "#6b8e23", "#882255", "#4b5fd1", "#a3611f", "#5f7f7f", "#e07bb0",
    "#8c8c00", "#994f88", "#2f6b4f", "#c9505c", "#7d6bb5", "#9a8f5a", "#4f3b78", "#b0764f", "#556b2f", "#a03c78",
)  # fmt: skip
"""Of the methods that are chosen more seldom, in their order; one that is none of these has one of them by its name."""
METHOD_NAMES = {
    "likelihood": "maximum likelihood",
    "gaussian": "Gaussian fit",
    "centre_of_mass": "centre of mass",
}


def method_colour(method: str) -> str:
    """The colour of an extraction method, the same in every figure."""
    seldom = [name for name in get_args(Method) if name not in METHODS]
    place = seldom.index(method) if method in seldom else sum(method.encode("utf-8", "replace"))
    return METHODS.get(method) or OTHERS[place % len(OTHERS)]


def method_name(method: str) -> str:
    """As written in text."""
    return METHOD_NAMES.get(method, method.replace("_", " "))


def wavelength_colour(wavelength_nm: float) -> tuple[float, float, float]:
    """sRGB, 0 to 1, of a spectral line; outside the visible range a dark red or violet stands for it.

    CIE 1931 by the fit of Wyman, Sloan & Shirley (2013), JCGT 2(2), eq. 4; then IEC 61966-2-1, clipped to the gamut
    and scaled so that the largest channel is 1: hue matters here, not brightness.
    """
    x, y, z = _cie_1931(min(max(wavelength_nm, 405.0), 690.0))
    linear = [
        3.2406 * x - 1.5372 * y - 0.4986 * z,
        -0.9689 * x + 1.8758 * y + 0.0415 * z,
        0.0557 * x - 0.2040 * y + 1.0570 * z,
    ]
    linear = [max(0.0, value) for value in linear]
    largest = max(linear)
    dim = 1.0 if 380.0 <= wavelength_nm <= 750.0 else 0.25
    encoded = [_srgb(dim * value / largest) for value in linear]
    return encoded[0], encoded[1], encoded[2]


def _cie_1931(nm: float) -> tuple[float, float, float]:
    def lobe(peak: float, below: float, above: float) -> float:
        return math.exp(-0.5 * ((nm - peak) * (below if nm < peak else above)) ** 2)

    x = 0.362 * lobe(442.0, 0.0624, 0.0374) + 1.056 * lobe(599.8, 0.0264, 0.0323) - 0.065 * lobe(501.1, 0.0490, 0.0382)
    y = 0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322)
    z = 1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725)
    return x, y, z


def _srgb(value: float) -> float:
    return 12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055


def hex_colour(rgb: tuple[float, float, float]) -> str:
    """#rrggbb."""
    return "#" + "".join(f"{round(255 * value):02x}" for value in rgb)
