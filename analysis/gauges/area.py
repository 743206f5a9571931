"""The area between a profile and a reference line, with its derivative by every point."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.gauges.fit import Fit, Frame
from analysis.gauges.profile import Profile
from analysis.gauges.spikes import NEIGHBOURS, spikes

UNSURE = 10.0
"""Times the section's median sigma: a straight line over such a point's place knows more than the point."""
LONGEST_RUN = 5
"""Of such points, in a row."""
UNSEEN, UNSEEN_SHARE = 5.0, 0.02
"""Times the usual distance between points, of one that is a stretch without any; of the section, what all of these may
be before it is told."""
MISSING = 0.05
"""Of a section's length at either end, beyond which a section without points has no area."""


def section(region: tuple[float, float], frame: Frame) -> tuple[float, float]:
    """A region's ends along the frame's axis, m."""
    low, high = ((x - frame.centre[0]) / max(frame.axes[0, 0], 1e-6) for x in region)
    return float(low), float(high)


def without_unsure(profile: Profile, region: tuple[float, float]) -> Profile:
    """The profile less the points of the region that are far less sure than is usual there, but for long runs of them,
    over which a straight line would know less than they do: where a line is saturated they are all that is known."""
    inside = profile.weight(*region) > 0.0
    sigma = np.linalg.norm(profile.random, axis=1)
    usual = float(np.median(sigma[inside])) if inside.any() else 0.0
    unsure = inside & (sigma > UNSURE * usual)
    run = np.append(0, np.cumsum(unsure[1:] != unsure[:-1])) if len(unsure) else np.zeros(0, np.intp)
    short = np.bincount(run, minlength=1)[run] <= LONGEST_RUN
    return profile.taken(~(unsure & short))


def section_points(profile: Profile, region: tuple[float, float], frame: Frame) -> NDArray[np.intp]:
    """The points within a region and one beyond each of its ends, by their order along the frame, without spikes."""
    local = frame.local(profile.position)
    low, high = section(region, frame)
    order = np.argsort(local[:, 0], kind="stable")
    first, last = np.searchsorted(local[order, 0], [low, high])
    # judged among neighbours beyond the ends as well: of two points at an end either may be the false one
    begin = max(first - 1 - NEIGHBOURS, 0)
    wide = order[begin : last + 1 + NEIGHBOURS]
    false = spikes(local[wide], np.linalg.norm(profile.random[wide], axis=1))
    taken = slice(max(first - 1, 0) - begin, last + 1 - begin)
    return np.asarray(wide[taken][~false[taken]])


@dataclass(frozen=True)
class Unseen:
    """Stretches of a section without points, or with none that are sure."""

    length: float
    """m, of all of them; 0 where they are too short to be told."""
    sigma: float
    """m^2, of the area there: that of any place, as likely as another, within half a box on either side of the straight
    line, the box as long as the stretch and as high as its ends are apart, or, of ends at one height, as it is long."""

    @property
    def remark(self) -> str:
        """Empty: there are none to be told."""
        if self.length == 0.0:
            return ""
        return (
            f"{1e3 * self.length:.3g} mm of its section carry no points, or none that are sure: straight lines join "
            "the others, and its sigma allows for half a box on either side of them"
        )


def unseen(profile: Profile, region: tuple[float, float], frame: Frame) -> Unseen:
    """Where an area knows nothing of its section."""
    along, across = frame.local(profile.position[section_points(profile, region, frame)]).T
    apart = np.diff(np.clip(along, *section(region, frame)))
    wide = apart > UNSEEN * np.median(apart) if len(apart) else np.zeros(0, dtype=np.bool_)
    length, height = apart[wide], np.abs(np.diff(across))[wide]
    told = float(length.sum()) > UNSEEN_SHARE * (region[1] - region[0])
    half_box = 0.5 * float(np.sum(length * np.maximum(height, length)))
    return Unseen(float(length.sum()) if told else 0.0, half_box / math.sqrt(3.0))


def area_above(profile: Profile, region: tuple[float, float], frame: Frame) -> Fit:
    """theta: m^2 between the profile and the frame's axis; what lies towards the laser counts positive.

    The integral of straight lines between points, also where some are missing, over a section with fixed ends, so that
    noise does not choose what counts. NaN where the points end before the section does.
    """
    order = section_points(profile, region, frame)
    gradient, here = np.zeros((1, len(profile.index), 2)), np.zeros(len(profile.index), dtype=np.bool_)
    here[order] = True
    along, across = frame.local(profile.position[order]).T
    low, high = section(region, frame)
    if len(order) < 2 or max(along[0] - low, high - along[-1]) > MISSING * (high - low):
        return Fit(np.array([math.nan]), np.zeros(1), gradient, here, frame, 1.0)
    p, q = np.clip(along[:-1], low, high), np.clip(along[1:], low, high)
    span = np.maximum(np.diff(along), 1e-15)
    # of every straight line, the integrals of what its two points are weighed by
    first = ((along[1:] - p) ** 2 - (along[1:] - q) ** 2) / (2.0 * span)
    second = ((q - along[:-1]) ** 2 - (p - along[:-1]) ** 2) / (2.0 * span)
    by_across = np.append(first, 0.0) + np.append(0.0, second)
    slope = np.diff(across) / span
    by_along = -np.append(slope * first, 0.0) - np.append(0.0, slope * second)

    gradient[0, order] = np.stack([by_along, by_across], axis=1) @ frame.axes
    return Fit(np.array([by_across @ across]), np.array([profile.sigmas(gradient[0])[0]]), gradient, here, frame, 1.0)
