"""What a person reads of a calibration: parameters, depth, checks, and where to hold the board next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.calibration.calibrate import Calibrated
from analysis.calibration.depth import Volume
from analysis.calibration.estimate import unit_plane
from analysis.calibration.lens_choice import PROOF, LensTrial
from analysis.calibration.next_pose import Advice
from analysis.calibration.recheck import Part, Recheck
from render.base.arrays import Float
from studio.calibration.motion_file import EXACT, motion_rows

WARP = "board warp um"
"""How far the board's middle stands out of its edges: along x, and along y."""
SMALL_GAIN = 0.03
"""Of the depth error: what one more view should take off it to be worth while."""


def laser_name(number: int, names: Sequence[str] = ()) -> str:
    """As the project calls it, else its number."""
    return names[number] if number < len(names) else f"laser {number}"


def parameter_rows(result: Calibrated, names: Sequence[str] = ()) -> list[tuple[str, str, str]]:
    """Name, value and sigma of everything that was estimated; names of the lasers."""
    estimate, covariance = result.estimate, result.adjusted.solution.covariance
    sigma = np.sqrt(np.diag(covariance))
    camera = slice(0, estimate.camera_count)
    rows = camera_rows(estimate.names[camera], estimate.shared[camera], sigma[camera])
    for i, m in enumerate(estimate.planes):
        own = estimate.plane_slice(i)
        rows += plane_rows(laser_name(i, names), m, covariance[own, own])
    rows += motion_rows(result)
    warp = 1e6 * estimate.warp
    at = estimate.camera_count
    if result.adjusted.solution.free[at]:
        rows.append((WARP, f"{round(warp[0])} {round(warp[1])}", f"{1e6 * sigma[at]:.2g} {1e6 * sigma[at + 1]:.2g}"))
    return rows


def camera_rows(
    names: Sequence[str], values: Sequence[float] | Float, sigma: Float | None
) -> list[tuple[str, str, str]]:
    """Of fx, fy, cx, cy and the distortion; sigma None or NaN: exact."""
    rows = []
    for i, (name, value) in enumerate(zip(names, values, strict=True)):
        digits, unit = (".3f", " px") if i < 4 else (".6g", "")
        told = EXACT if sigma is None or np.isnan(sigma[i]) else f"{sigma[i]:.2g}"
        rows.append((name + unit, f"{value:{digits}}", told))
    return rows


def plane_rows(laser: str, m: Float, covariance: Float | None) -> list[tuple[str, str, str]]:
    """Of a laser's plane m . P = 1; covariance (3, 3) of m, None: exact."""
    a, b, c, d = unit_plane(m)
    turn, way = EXACT, EXACT
    if covariance is not None:
        by_d = m / np.linalg.norm(m) ** 3
        most, along = np.maximum([np.linalg.eigvalsh(covariance)[-1], by_d @ covariance @ by_d], 0.0)
        turn, way = f"{1e3 * np.sqrt(most) / np.linalg.norm(m):.2g} mrad", f"{1e3 * np.sqrt(along):.2g}"
    return [
        (f"{laser}: normal", f"{a:.6f} {b:.6f} {c:.6f}", turn),
        (f"{laser}: distance mm", f"{-1e3 * d:.4f}", way),
    ]


def span_of(laser: str, volume: Volume) -> str:
    """Where a laser's depth is told."""
    return f"{laser}, {volume.depth.min():.3g} to {volume.depth.max():.3g} m"


def depth_rows(
    result: Calibrated, true: list[tuple[float, float]] | None, names: Sequence[str] = ()
) -> list[tuple[str, ...]]:
    """For each laser: rms and greatest systematic error, that of the line's noise, and the true one if known; um."""
    rows = []
    for i, one in enumerate(result.depth):
        random = float(np.sqrt(np.mean(one.random**2)))
        cells = [one.rms, float(one.systematic.max()), random] + ([true[i][0]] if true else [])
        span = span_of(laser_name(one.volume.laser, names), one.volume)
        rows.append((span, *(f"{1e6 * cell:.1f}" for cell in cells)))
    return rows


def other_rows(others: dict[str, list[float]], jointly: list[tuple[float, float]]) -> list[tuple[str, ...]]:
    """True depth error of each laser, um, by every way, all at once last."""
    ways = {**others, "all at once": [true for true, _ in jointly]}
    return [(name, *(f"{1e6 * value:.1f}" for value in values)) for name, values in ways.items()]


def check_rows(result: Calibrated, views: int) -> list[tuple[str, str]]:
    """Sentences: residuals, halves, whiteness, choice of lens."""
    adjusted = result.adjusted
    residual = adjusted.solution.corner_residual
    seen = adjusted.seen
    used = seen.whitening[:, 0, 0] > 0.0
    pixel = np.linalg.solve(seen.whitening[used], residual[used][:, :, None])[:, :, 0]
    rms = float(np.sqrt(np.mean(np.sum(pixel**2, axis=1))))
    rows = [
        ("views", f"{adjusted.solution.estimate.rotation.shape[0]} of {views} used, {int(used.sum())} corners"),
        ("reprojection", f"{rms:.3f} px rms; corners err {adjusted.corner_scale:.2f} times as told by their images"),
    ]
    if seen.lasers:
        points = int(np.count_nonzero(seen.laser_weight))
        rows.append(("lines", f"{points} points; they err {adjusted.laser_scale:.2f} times as told by their images"))
    if result.halves is not None:
        rows.append(("halves", result.halves.sentence))
    rows.append(("residuals", result.whiteness.sentence))
    if result.lens_trials:
        rows.append(("lens", lens_sentence(len(result.estimate.distortion), result.lens_trials)))
    return rows


def lens_sentence(terms: int, trials: Sequence[LensTrial]) -> str:
    """Which lens was chosen and why, and how every lens that was tried did at views that it was not fitted to."""
    tried = "; ".join(_trial_words(one, trials, terms) for one in trials)
    depth = ", how far off its boards depth was" if any(one.depth for one in trials) else ""
    return (
        f"{terms} distortion terms: the fewest to which no lens with more is proved better on views that were left out "
        f"of its fit. Each lens with the mean squared residual there{depth}, and p, the chance that noise alone makes "
        f"a lens with more terms seem so much better (below {PROOF:g} more terms are proved to help): {tried}"
    )


def _trial_words(one: LensTrial, trials: Sequence[LensTrial], terms: int) -> str:
    best = one is min(trials, key=lambda other: other.held_out)
    marks = ", ".join(mark for mark, true in (("chosen", one.terms == terms), ("the least residual", best)) if true)
    depth = f", {1e6 * one.depth:.0f} um" if one.depth else ""
    # of the lens with most terms there is none with more
    chance = f", p {one.p:.1g}" if one is not trials[-1] else ""
    return f"{one.terms} terms {one.held_out:.4g}{depth}{chance}" + (f" ({marks})" if marks else "")


def next_sentence(advice: Advice, target_um: float | None) -> str:
    """Where to hold the board next and what it gains, or that it is enough."""
    before, after = 1e6 * advice.before, 1e6 * advice.after
    if target_um is not None and before <= target_um:
        return f"enough: depth is known to {before:.1f} um, {target_um:g} um were asked for"
    x, y, z = 1e3 * advice.centre
    normal = advice.rotation[:, 2] * np.sign(advice.rotation[2, 2])
    sides = []
    if abs(normal[0]) > 0.1:
        sides.append("right" if normal[0] < 0.0 else "left")
    if abs(normal[1]) > 0.1:
        sides.append("lower" if normal[1] < 0.0 else "upper")
    turned = f"its {' and '.join(sides)} edge farther away" if sides else "facing the camera"
    told = (
        f"next: hold the board's middle {z:.0f} mm ahead, {abs(x):.0f} mm {'right' if x >= 0 else 'left'} and "
        f"{abs(y):.0f} mm {'below' if y >= 0 else 'above'} of the camera's axis, tilted by "
        f"{np.degrees(advice.tilt):.0f} deg, {turned}: depth error {before:.1f} -> {after:.1f} um"
    )
    if target_um is None:
        return told + ("; one more view gains little" if advice.gain < SMALL_GAIN * advice.before else "")
    views = advice.views_until(1e-6 * target_um)
    if views is None:
        return f"{told}; {target_um:g} um take more than {len(advice.ahead)} views more"
    return f"{told}; " + (
        f"{target_um:g} um are reached by it" if views == 1 else f"{target_um:g} um take about {views} views more"
    )


def recheck_sentence(part: Part) -> str:
    """How far new views are from a calibration, beside their own noise."""
    chance = f"p = {part.p:.2g}" if part.p >= 1e-4 else "p < 0.0001"
    if part.laser is None:
        return f"corners {part.off:.3f} px rms from where it has them, {part.noise:.3f} of the best fit ({chance})"
    off, noise = 1e6 * part.off, 1e6 * part.noise
    return f"its line {off:.0f} um rms in depth from where it has it, {noise:.0f} of the best fit ({chance})"


def recheck_verdict(result: Recheck) -> str:
    """What to do."""
    changed = result.changed
    if not changed:
        return "the calibration holds: the photographs are as far from it as its errors and their noise explain"
    if changed[0].laser is None:
        return (
            "the camera is no longer as calibrated (focus, aperture or a lens that turned, or another board): "
            "calibrate camera and lasers again"
        )
    names = " and ".join(part.name for part in changed)
    return (
        f"{names} no longer as calibrated: the laser moved against the camera, or the lens did by less than these "
        "views of the board can tell; calibrate again"
    )
