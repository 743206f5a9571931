"""A line's mean profiles -> the sheet's width, the lens blur and the halo, by least squares on all of them at once.

profile     (1 - halo) G(sqrt(a S + K), t B) + halo G(halo_sigma), each integrated over the pixel
S, K, t     of the project's sheet, px^2; of defocus and positions, px^2; tilt of the line against a round blur
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.special import ive, ndtr

from render.base.arrays import Float
from render.base.errors import InputError
from studio.photographs.line_profile import BIN, Profile, mean_profile
from studio.photographs.twin_seen import HALF, ROWS, Seen

STRETCHES = 8
"""By the sheet's width, at most."""
EDGES = 0.02, 0.98
"""Quantiles of the sheet's width between which it is cut evenly."""
WIDEST = 1e4
"""Of the variance of the project's sheet, the most that is believed."""
SHORTEST = 16
"""Bins of a profile below which no width is fitted."""
TOLD = 0.1
"""Relative sigma of the sheet's width and the blur above which the photographs do not tell them apart."""
VARIED = 0.1
"""Change of the sheet's variance along the line, below which only the shape of a Gaussian's pixels would part them."""
SURE = 3.0
"""Sigmas from which a halo is there."""


@dataclass(frozen=True)
class Part:
    """The mean profile of a stretch of line whose sheet is about as wide, and means of its scan lines."""

    profile: Profile
    sheet: float
    """px^2, of the project's sheet."""
    known: float
    """px^2: defocus, and scatter of the positions."""
    tilt: float
    place: int
    """Among the stretches."""


@dataclass(frozen=True)
class Shape:
    """(4,) scale of the sheet's variance, blur px^2, halo, halo px; their sigmas; which of them were told apart."""

    values: Float
    sigmas: Float
    apart: bool
    haloed: bool
    best: Float
    """(4,) as fitted, before the blur was put back to the project's."""
    line: float
    """Sigma of the line's variance, px^2, sheet and blur together."""
    unlike: float
    """px^2: by how much that variance is another one at most if all of it is the sheet's, or the blur's; 0 where they
    are told apart."""


def parts_of(seen: Seen) -> list[Part]:
    """Stretches of the line, the narrowest sheet first. InputError: no profile to be told."""
    whole = seen.whole
    added = np.nan_to_num(whole.stretch.sigma_u) ** 2 + whole.known + BIN**2 / 12.0
    place = np.searchsorted(cuts_of(seen) if seen.cuts is None else seen.cuts, whole.sheet)
    parts = []
    for k in np.unique(place):
        some = np.flatnonzero(place == k)
        sheet, known, tilt = (float(np.mean(one[some])) for one in (whole.sheet**2, added, whole.tilt))
        parts.append(Part(mean_profile(whole.stretch, some, seen.width), sheet, known, tilt, int(k)))
    if any(len(one.profile.value) < SHORTEST or not one.profile.value.max() > 0.0 for one in parts):
        raise InputError(
            "the line's profile cannot be told",
            found=f"{len(whole.u)} scan lines",
            cure="add photographs, or expose longer",
        )
    return parts


def cuts_of(seen: Seen) -> Float:
    """px of the project's sheet between stretches, evenly spread, with `ROWS` scan lines or more in each."""
    sheet = np.sort(seen.whole.sheet)
    low, high = np.quantile(sheet, EDGES)
    cuts: list[float] = []
    used = 0
    for at in range(ROWS, len(sheet) - ROWS):
        if at - used >= ROWS and sheet[at] - sheet[used] > (high - low) / STRETCHES and sheet[at] > sheet[at - 1]:
            cuts.append(float(0.5 * (sheet[at - 1] + sheet[at])))
            used = at
    return np.array(cuts)


def pixel_gaussian(distance: Float, sigma: Float | float) -> Float:
    """Share of a line of unit light, a Gaussian of `sigma` px, in a pixel so far from its middle."""
    return np.asarray(ndtr((distance + 0.5) / sigma) - ndtr((distance - 0.5) / sigma))


def blurred_line(distance: Float, sigma: Float | float, blur: float) -> Float:
    """The same through the sensor's blur (px^2), which acts on pixels (Lindeberg's discrete Gaussian)."""
    reach = int(np.ceil(5.0 * np.sqrt(blur) + 3.0))
    found, above = np.zeros(np.broadcast(distance, sigma).shape), ndtr((distance + reach + 0.5) / sigma)
    for k, tap in enumerate(ive(np.abs(np.arange(-reach, reach + 1)), blur)):
        below = ndtr((distance + reach - k - 0.5) / sigma)
        found += tap * (above - below)
        above = below  # where one pixel ends the next begins
    return found


def expected(values: Float, part: Part, distance: Float) -> Float:
    """The profile of a part at distances (n,) px by (4,) values of a `Shape`."""
    sharp = values[0] * part.sheet + part.known
    core = blurred_line(distance, np.sqrt(sharp), part.tilt * values[1])
    return np.asarray((1.0 - values[2]) * core + values[2] * pixel_gaussian(distance, np.sqrt(sharp + values[3] ** 2)))


def left_of(values: Float, part: Part) -> Float:
    """(m,) of a part's profile what is left by its own height and ground, in sigmas."""
    profile = part.profile
    one = expected(values, part, profile.distance)
    basis = np.stack([one, np.ones_like(one)], axis=1) / profile.sigma[:, None]
    value = profile.value / profile.sigma
    return np.asarray(value - basis @ np.linalg.lstsq(basis, value, rcond=None)[0])


def fit_shape(parts: list[Part], start: Float, halo: bool, like: Shape | None = None) -> Shape:
    """Profiles -> shape, from (4,) of the project. halo: one is looked for. like: a fit that tells what is apart.

    InputError: the line is narrower than the blur, or no width that the sheet could have.
    """
    width = np.sqrt(max(float(np.mean([one.sheet for one in parts])), 1e-6))
    start = start.copy()
    start[3] = max(start[3], 2.0 * np.hypot(width, np.sqrt(start[1]))) if halo else start[3]
    narrowest = max(1.5 * np.sqrt(_variance(parts)), 1.5)  # a narrower halo would be the line itself
    low, high = np.array([1e-6, 0.0, 0.0, narrowest]), np.array([1e6, 1e4, 0.5, max(HALF / 2.0, 2.0 * narrowest)])
    low[3] = low[3] if halo else 1e-6
    start = np.clip(start, low + 1e-9, high)

    def solved(free: list[int], start: Float) -> tuple[Float, Float, Float]:
        def some(q: Float) -> Float:
            p = start.copy()
            p[free] = q
            return np.concatenate([left_of(p, one) for one in parts])

        done = least_squares(some, start[free], bounds=(low[free], high[free]), x_scale="jac")
        excess = 2.0 * done.cost / max(len(done.fun) - len(free) - 2 * len(parts), 1)
        covariance = np.linalg.pinv(done.jac.T @ done.jac) * max(excess, 1.0)
        p, sigma = start.copy(), np.zeros(4)
        p[free], sigma[free] = done.x, np.sqrt(np.diag(covariance))
        return p, sigma, covariance

    haloed = halo if like is None else like.haloed
    if not haloed and halo:
        start[2] = 0.0
    p, sigma, covariance = solved([0, 1, 2, 3] if haloed else [0, 1], start)
    if like is None and haloed and not (p[2] > SURE * sigma[2] and sigma[3] < 0.5 * p[3] and p[3] > 1.05 * low[3]):
        haloed, start[2] = False, 0.0
        p, sigma, covariance = solved([0, 1], start)
    sheets = np.array([one.sheet for one in parts])
    varied = float(np.ptp(sheets)) > VARIED * float(np.mean(sheets))
    apart = varied and sigma[0] < 2.0 * TOLD * p[0] and sigma[1] < 2.0 * TOLD * max(p[1], 0.25)
    apart = bool(apart) if like is None else like.apart
    sheet, best = float(np.mean(sheets)), p.copy()
    spread = float(np.sqrt(max(np.array([sheet, 1.0]) @ covariance[:2, :2] @ np.array([sheet, 1.0]), 0.0)))
    unlike = 0.0
    if not apart:
        for free, other in ((0, 1), (1, 0)):
            alone = p.copy()
            alone[free], alone[other] = alone[free] + alone[other] * (sheet if free else 1.0 / sheet), low[other]
            q = solved([free], alone)[0]
            unlike = max(unlike, abs(float((q - best)[:2] @ [sheet, 1.0])))
        # the line's variance is told by its shape however it is shared; the sheet takes what the blur leaves
        p[0], p[1] = (p[0] * sheet + p[1] - start[1]) / sheet, start[1]
        sigma[0], sigma[1] = spread / sheet, 0.0
    _check(p, sigma, float(np.sqrt(start[1])))
    return Shape(p, sigma, apart, haloed, best, spread, unlike)


def _check(p: Float, sigma: Float, blur: float) -> None:
    """InputError: a sheet that is none."""
    if p[0] < 1e-4:
        raise InputError(
            "the line is narrower than the project's lens blur alone",
            where="sensor.blur_sigma",
            found=f"{blur:.3g} px of blur",
            cure="lower it in the project",
        )
    if p[0] > WIDEST or sigma[0] > p[0]:
        raise InputError(
            "the width of the line cannot be told by the project's sheet",
            found=f"{np.sqrt(p[0]):.3g} times as wide as the project's",
            cure="see that the photographs are of this project's scanner, from where it stands",
        )


def _variance(parts: list[Part]) -> float:
    """Of the line, px^2, by the half height of its profiles."""
    widths = []
    for one in (part.profile for part in parts):
        above = one.distance[one.value > 0.5 * one.value.max()]
        widths.append((above.max() - above.min()) / 2.355)
    return float(np.median(widths)) ** 2


def departures(values: Float, parts: list[Part]) -> dict[int, tuple[Float, Float]]:
    """By place, of each rehearsed profile: distances (m,) px, and by how much it is above what is expected of (4,)
    values."""
    profiles = [(one, one.profile) for one in parts]
    return {one.place: (of.distance, of.value - expected(values, one, of.distance)) for one, of in profiles}


def less(parts: list[Part], departed: dict[int, tuple[Float, Float]]) -> list[Part]:
    """The parts without what their rehearsal departs by; those that it shows nothing of are left out."""
    found = []
    for part in parts:
        if part.place not in departed:
            continue
        (distance, value), profile = departed[part.place], part.profile
        level = profile.value - np.interp(profile.distance, distance, value)
        found.append(replace(part, profile=profile._replace(value=level)))
    return found
