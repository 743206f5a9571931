"""How far an image is from its reference: energy, position, error; and how long an engine needs to a given error."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

FLOOR_TRUST = 0.8
"""A run whose error falls by less than this in a doubling of time stands on a floor."""


def relative_error(image: np.ndarray, reference: np.ndarray, pixels: np.ndarray) -> float:
    """RMS difference over the pixels, relative to the reference's RMS there."""
    difference = image[pixels] - reference[pixels]
    return float(np.sqrt(np.mean(difference**2) / np.mean(reference[pixels] ** 2)))


def energy(image: np.ndarray, reference: np.ndarray, pixels: np.ndarray) -> float:
    """Light in the pixels over the reference's."""
    return float(image[pixels].sum() / reference[pixels].sum())


def shift(image: np.ndarray, reference: np.ndarray, pixels: np.ndarray) -> float:
    """How far the image lies to the right of the reference, px: least squares on the reference's slope.

    image = a (reference - s d reference / du): brightness and place apart. Holds for shifts below a pixel.
    """
    slope = np.gradient(reference, axis=1)[pixels]
    columns = np.stack([reference[pixels], -slope], axis=1)
    (scale, moved), *_ = np.linalg.lstsq(columns, image[pixels], rcond=None)
    return float(moved / scale)


@dataclass(frozen=True)
class Seconds:
    """Seconds to a bar. kind: "" measured, "<" met at the shortest time, "~" extrapolated, "floor", "never"."""

    value: float
    kind: str = ""

    def __str__(self) -> str:
        if self.kind in ("floor", "never"):
            return self.kind if self.kind == "never" else f"floor {self.value:.1%}"
        return f"{self.kind}{self.value:.3g}"

    @property
    def reached(self) -> bool:
        return self.kind not in ("floor", "never")


def seconds_to(bar: float, times: np.ndarray, errors: np.ndarray) -> Seconds:
    """Seconds to an error, from (n,) times and errors of one engine, any order, several runs.

    Between measured times a line in log-log; beyond the longest as 1 / sqrt(t), unless the error has ceased to fall.
    """
    order = np.argsort(times)
    t, e = times[order], errors[order]
    if not len(t):
        return Seconds(math.nan, "never")
    t, e = _medians(t, e)
    if e[-1] > 0.97:
        return Seconds(math.nan, "never")
    below = np.flatnonzero(e <= bar)
    if len(below):
        i = int(below[0])
        if i == 0:
            return Seconds(float(t[0]), "<")
        share = math.log(e[i - 1] / bar) / math.log(e[i - 1] / e[i])
        return Seconds(float(t[i - 1] * (t[i] / t[i - 1]) ** share))
    floor = fitted_floor(t, e)
    if floor > bar:
        return Seconds(floor, "floor")
    return Seconds(float(t[-1] * (e[-1] ** 2 - floor**2) / (bar**2 - floor**2)), "~")


def fitted_floor(times: np.ndarray, errors: np.ndarray) -> float:
    """b of e^2 = a / t + b^2, 0 where it does not stand out: the last doubling still gained as noise does."""
    if len(times) < 3:
        return 0.0
    weights = 1.0 / errors**2
    columns = np.stack([1.0 / times, np.ones_like(times)], axis=1)
    (_, b), *_ = np.linalg.lstsq(columns * weights[:, None], errors**2 * weights, rcond=None)
    gain = (errors[-1] / errors[-2]) / math.sqrt(times[-2] / times[-1])
    return math.sqrt(b) if b > 0.0 and gain > 1.0 / FLOOR_TRUST else 0.0


def _medians(times: np.ndarray, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Runs at about the same time (within 20 %) as one point each: the median of both."""
    groups: list[list[int]] = []
    for i in range(len(times)):
        if groups and times[i] < 1.2 * times[groups[-1][0]]:
            groups[-1].append(i)
        else:
            groups.append([i])
    return (
        np.array([float(np.median(times[g])) for g in groups]),
        np.array([float(np.median(errors[g])) for g in groups]),
    )
