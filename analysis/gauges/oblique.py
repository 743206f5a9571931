"""How obliquely a section crosses the faces that a measure is of, and the same points in a section square to them.

Only where the truth tells the surface's normals. A flat face says across itself alone where a section is square to it,
two that are not parallel, or one that is round about one axis, say along which direction they run.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from analysis.gauges.profile import Profile
from render.base.arrays import Float

FEWEST = 3
"""Points with a normal."""
FLAT = 1e-2
"""Of the second singular value of normals, over the first: beneath it they are all alike."""
OF_ONE_DIRECTION = 0.1
"""The same of the third over the one that still counts: above it faces run along no direction in common."""
NEARLY_ALONG = math.radians(80.0)
"""More oblique sections show nothing of the faces' shape."""
SQUARE = math.radians(0.5)
"""A section that is no farther off is called square."""


def running_along(profile: Profile, used: Float) -> Float | None:
    """(3,) unit, in the section's frame: along which the faces at the points with weights (m,) run, on the side of the
    section's normal; None: they run along none in common, or their normals are unknown."""
    if profile.normal is None:
        return None
    here = (used > 0.0) & np.isfinite(profile.normal).all(axis=1)
    if np.count_nonzero(here) < FEWEST:
        return None
    _, size, axes = np.linalg.svd(np.sqrt(used[here])[:, None] * profile.normal[here], full_matrices=False)
    if size[1] < FLAT * size[0]:
        along = np.array([1.0, 0.0, 0.0]) - axes[0, 0] * axes[0]
    elif size[2] < OF_ONE_DIRECTION * size[1]:
        along = axes[2]
    elif size[1] < OF_ONE_DIRECTION * size[0]:  # rough, and flat on the whole
        along = np.array([1.0, 0.0, 0.0]) - axes[0, 0] * axes[0]
    else:
        return None
    length = math.copysign(float(np.linalg.norm(along)), along[0])
    return np.asarray(along / length) if length else None


def obliquity(along: Float) -> float:
    """rad, from a section's normal to a direction (3,) in its frame."""
    return math.atan2(math.hypot(along[1], along[2]), abs(float(along[0])))


def square_profile(profile: Profile, along: Float) -> Profile | None:
    """The points carried along a direction (3,) onto a section square to it; they weigh as before.

    None: the section runs along the faces, or where the points are is unknown.
    """
    if profile.place is None or obliquity(along) > NEARLY_ALONG:
        return None
    across = np.array([0.0, 1.0, 0.0]) - along[1] * along
    across /= np.linalg.norm(across)
    up = -np.cross(along, across)
    return replace(profile, position=profile.place @ np.stack([across, up], axis=1), fitted={})


def moved_regions(
    regions: tuple[tuple[float, float], ...], parts: list[Float], profile: Profile, square: Profile
) -> tuple[tuple[float, float], ...] | None:
    """Ends of the regions in the square section, m, as far as their points (weights (m,) each) have moved there.

    None: the points of a region are turned about by it.
    """
    made = []
    for ends, part in zip(regions, parts, strict=True):
        before, after = (one.position[part > 0.0, 0] for one in (profile, square))
        middle = before.mean()
        spread = float(((before - middle) ** 2).sum())
        slope = float((before - middle) @ after) / spread if spread > 0.0 else 1.0
        if slope <= 0.0:
            return None
        low, high = (float(after.mean() + slope * (end - middle)) for end in ends)
        made.append((low, high))
    return tuple(made)


def oblique_remark(profile: Profile, along: Float, value: str) -> str:
    """What is told of a measure whose `value` in words is that square to its faces; empty: there is none."""
    best = max(profile.section.others, key=lambda other: abs(float(other[1] @ along)), default=("", np.zeros(3)))
    cure = "turn the laser"
    if abs(float(best[1] @ along)) >= math.cos(SQUARE):
        cure = f"choose “{best[0]}” in the list of sections, or turn the laser"
    elif profile.section.others:
        cure = "no other in the list of sections is square to them either; turn the laser"
    angle = f"{math.degrees(obliquity(along)):.1f}°"
    if not value:
        return f"the section runs along its faces ({angle} from square to them), whose shape it does not show; {cure}"
    return f"the section crosses its faces {angle} obliquely: square to them it is {value}; {cure}"
