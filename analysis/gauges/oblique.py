"""How obliquely a section crosses the faces that a measure is of, and the same points in a section square to them.

Only where the truth tells the surface's normals. A flat face says across itself alone where a section is square to it,
two that are not parallel, or one that is round about one axis, say along which direction they run. A ball has no such
direction: its own radius follows from how its normals lean off the plane that cuts it.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

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
NOT_OF_A_BAR = 1e-3
"""Of a unit normal off the plane that a bar's lie in: facets alone turn them by less."""
LEAST_OBLIQUE = math.radians(0.05)
"""Changes no dimension by as much as a millionth: what a curve that does not fit changes by it is not the section's."""
SQUARE = math.radians(0.5)
"""A section that is no farther off is called square."""


def running_along(profile: Profile, used: Float) -> Float | None:
    """(3,) unit, in the section's frame: along which the faces at the points with weights (m,) run, on the side of the
    section's normal; None: they run along none in common, or their normals are unknown."""
    if profile.normal is None:
        return None
    here = _known(profile, used)
    if np.count_nonzero(here) < FEWEST or _of_a_ball(profile.normal[here]):
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


def _known(profile: Profile, used: Float) -> NDArray[np.bool_]:
    """(m,) points that a measure uses, weights (m,), and whose normals are known."""
    assert profile.normal is not None
    return np.asarray((used > 0.0) & np.isfinite(profile.normal).all(axis=1))


def _of_a_ball(normal: Float) -> bool:
    """Whether normals (m, 3) lean towards one direction all alike, as where a plane cuts a ball, and not as a bar's or
    any other face's."""
    least = float(np.linalg.svd(normal, compute_uv=False)[2])
    alike = float(np.linalg.svd(normal - normal.mean(axis=0), compute_uv=False)[2])
    return least > NOT_OF_A_BAR * math.sqrt(len(normal)) and alike < 0.5 * least


def lean_off_a_ball(profile: Profile, used: Float) -> tuple[float, bool] | None:
    """rad, between the plane of the points with weights (m,) and the normals of the ball that they are of, and whether
    the section is that plane; None: they are of no ball, or nothing is known of it."""
    if profile.normal is None or profile.place is None:
        return None
    here = _known(profile, used)
    if np.count_nonzero(here) < FEWEST or not _of_a_ball(profile.normal[here]):
        return None
    place = profile.place[here]
    across = np.linalg.svd(place - place.mean(axis=0), full_matrices=False)[2][2]
    lean = math.asin(min(abs(float(np.median(profile.normal[here] @ across))), 1.0))
    return lean, abs(float(across[0])) >= math.cos(SQUARE)


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
