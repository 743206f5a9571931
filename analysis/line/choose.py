"""The method an image needs and no more: the phase where it costs next to nothing against maximum likelihood."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from analysis.line.detection.channel import Lines
from analysis.line.measure import measure
from analysis.line.result import Flag, Line
from analysis.line.settings import ExtractionSettings, Method

LINES = 256
"""Scan lines looked at."""
FEWEST = 8
SATURATED_SHARE = 0.01
NARROWEST = 0.6
"""px; narrower lines need the profile integrated over the pixel."""
FAINTEST = 30.0
"""Peak over the noise of its background; below it the far wings carry only noise, and weights pay."""
LOSS = 1.02
"""Standard deviation of the phase over that of the likelihood that is not worth the time."""
AGREEMENT = 0.3
"""Standard deviations that the two may differ by beyond what noise explains: neighbours, slopes and tails."""


def choose_method(lines: Lines, settings: ExtractionSettings, threads: int | None) -> tuple[Method, str]:
    """Either "phase" or "likelihood", and why, from up to 256 scan lines."""
    stride = max(1, lines.count // LINES) | 1  # odd: keeps the rows of a Bayer pattern alternating
    variance = None if lines.variance is None else lines.variance[::stride]
    sample = replace(lines, image=lines.image[::stride], variance=variance)
    update = {"peaks": 1, "select": "strongest", "smoothing": 0.0}
    exact = measure(sample, settings.model_copy(update={**update, "method": "likelihood"}), threads)
    valid = exact.valid[:, 0]
    if valid.sum() < FEWEST:
        return "likelihood", f"likelihood: a line on {int(valid.sum())} of {sample.count} scan lines looked at"
    saturated = int(np.count_nonzero(exact.flag[valid, 0] == Flag.SATURATED))
    if saturated > SATURATED_SHARE * valid.sum():
        told = f"saturated on {saturated} of {int(valid.sum())} scan lines looked at, measured from its wings"
        return "likelihood", f"likelihood: {told}"
    width = float(np.median(exact.width[valid, 0]))
    if width < NARROWEST:
        return "likelihood", f"likelihood: {width:.2f} px narrow, integrated over each pixel"
    dark = np.maximum(exact.background[valid, 0], 0.0) + lines.noise.floor
    contrast = float(np.median(exact.amplitude[valid, 0] / np.sqrt(dark)))
    if contrast < FAINTEST:
        return "likelihood", f"likelihood: faint, its peak {contrast:.0f} times the noise"
    quick = measure(sample, settings.model_copy(update={**update, "method": "phase"}), threads)
    objection, more = _loss(quick, exact)
    if objection:
        return "likelihood", f"likelihood: {objection}"
    told = f"sigma {more:.1%} above that of likelihood" if more >= 0.001 else "sigma as that of likelihood"
    return "phase", f"phase: {width:.2f} px wide, {contrast:.0f} times the noise, unsaturated, {told}"


def _loss(quick: Line, exact: Line) -> tuple[str, float]:
    """What speaks against the quick method, empty where nothing does, and by how much its sigma is larger."""
    both = (quick.valid & exact.valid)[:, 0] & np.isfinite(quick.sigma_u[:, 0])
    if both.sum() < 0.9 * exact.valid.sum() or both.sum() < FEWEST:
        return "the phase has no answer or no sigma on some scan lines", math.nan
    ratio = float(np.median(quick.sigma_u[both, 0] / exact.sigma_u[both, 0]))
    if ratio > LOSS:
        return f"the phase would be {ratio - 1:.0%} noisier", ratio - 1.0
    variance = np.median(exact.sigma_u[both, 0] ** 2)
    # the likelihood is efficient, so that what the phase adds is independent of it (Lehmann and Casella, 2.1.7)
    allowed = max(ratio**2 - 1.0, 0.02) + AGREEMENT**2
    apart = np.median(np.abs(quick.u[both, 0] - exact.u[both, 0])) * 1.4826
    if apart**2 > allowed * variance:
        return f"the phase is {apart:.3f} px apart from it, by neighbours, a slope or tails", ratio - 1.0
    return "", ratio - 1.0
