"""Profiles of shapes with exact dimensions, and noise as points of a laser line have it."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from analysis.gauges.gauge import REGIONS, Gauge
from analysis.gauges.profile import Profile

PITCH = 2e-4
ACROSS = (np.arange(-100, 100) + 0.5) * PITCH
REGION = {
    "step": ((-0.015, -0.003), (0.003, 0.015)),
    "width": ((0.012, 0.02), (-0.009, -0.002), (0.002, 0.009)),
    "angle": ((-0.015, -0.003), (0.003, 0.015)),
    "opening": ((-0.015, -0.003), (0.003, 0.015)),
    "radius": ((-0.006, 0.006),),
    "v_depth": ((0.012, 0.02), (-0.009, -0.002), (0.002, 0.009)),
    "peak": ((-0.02, -0.01), (-0.004, 0.004)),
    "straightness": ((-0.01, 0.01),),
    "flatness": ((-0.01, 0.01),),
    "point_to_point": ((-0.015, -0.013), (0.009, 0.011)),
    "thickness": ((-0.015, -0.003), (0.003, 0.015)),
    "gap": ((-0.0115, -0.0065), (0.0065, 0.0115)),
    "edge_to_edge": ((-0.009, -0.001), (0.001, 0.009)),
    "flush": ((-0.015, -0.003), (0.003, 0.015)),
    "area": ((0.012, 0.02), (-0.009, -0.002)),
}
BENT = 0.02
"""1/m, half the curvature of the bent shape."""


def gauge(kind: str, **values: object) -> Gauge:
    return Gauge(kind=kind, regions=REGION[kind], **values)  # type: ignore[arg-type]


def shape(kind: str) -> tuple[np.ndarray, float]:
    """Heights at ACROSS, m, and the exact dimension in the regions of `gauge(kind)`."""
    x, far = ACROSS, -0.5
    groove = np.minimum(np.abs(x) - 0.01, 0.0)
    match kind:
        case "step":  # on a slope of 0.1
            return far + 0.1 * x + 0.002 * (x > 0.0), 0.002 / np.sqrt(1.01)
        case "angle":
            return far + np.where(x > 0.0, 0.5, -0.2) * x, np.arctan(0.5) + np.arctan(0.2)
        case "opening":
            return far + np.abs(x), np.pi / 2.0
        case "width":
            return far + groove, 0.02
        case "area":  # the wall's middle lies 4.5 mm deep
            return far + groove, -0.0045 * 0.007
        case "thickness" | "flush":  # sheets that are not parallel
            at = 0.009 if kind == "thickness" else 0.003
            return far + np.where(x > 0.0, 0.002 + 0.12 * x, 0.1 * x), (0.002 + 0.02 * at) / np.sqrt(1.01)
        case "gap":
            return far + np.sqrt(0.004**2 - np.minimum((np.abs(x) - 0.009) ** 2, 0.0039**2)), 0.01
        case "edge_to_edge":  # its edges lie midway between points
            return slot(-0.005, 0.005), 0.01 * np.sqrt(1.01)
        case "v_depth":
            return far + groove, 0.01
        case "radius":
            return far + np.sqrt(0.01**2 - np.minimum(x**2, 0.0099**2)), 0.01
        case "peak":
            return far + np.maximum(0.003 - 100.0 * (x - 0.001) ** 2, 0.0), 0.003
        case "straightness":
            return far - BENT * x**2, BENT * 0.01**2
        case _:
            return far + 0.3 * x, 0.024 * np.sqrt(1.09)


def between(first: float, second: float) -> np.ndarray:
    """Which of ACROSS lie between two places, m."""
    return np.abs(ACROSS - 0.5 * (first + second)) < 0.5 * (second - first)


def slot(first: float, second: float, depth: float = 0.01) -> np.ndarray:
    """Heights at ACROSS of a slot with upright walls at two places, in a face of slope 0.1."""
    return -0.5 + 0.1 * ACROSS - depth * between(first, second)


def profile(
    height: np.ndarray,
    sigma: float = 1e-5,
    length: float = 1.0,
    noise: np.ndarray | None = None,
    systematic: np.ndarray | None = None,
) -> Profile:
    """Points at ACROSS, moved by `noise` (m,) sigmas along a slanted line of sight.

    systematic (m, 2, k): as of `Profile`.
    """
    count = len(height)
    sight = np.stack([np.full(count, 0.2), np.linspace(0.8, 1.2, count)], axis=1) * sigma
    position = np.stack([ACROSS, height], axis=1) + (0.0 if noise is None else sight * noise[:, None])
    shared = np.zeros((count, 2, 0)) if systematic is None else systematic
    return Profile(position, sight, shared, np.arange(count), np.full(count, length))


def noises(trials: int, length: float, seed: int) -> np.ndarray:
    """(trials, m) of variance 1, correlated over a length of scan lines."""
    r = (length - 1.0) / (length + 1.0)
    white = np.random.default_rng(seed).standard_normal((trials, len(ACROSS)))
    white[:, 1:] *= np.sqrt(1.0 - r**2)
    return lfilter([1.0], [1.0, -r], white, axis=1)


KINDS = tuple(kind for kind in REGIONS if kind != "flatness")
