"""From views of a board to a calibration that says how good it is: the whole way in one call."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.calibration.adjust import Prior
from analysis.calibration.checks import Halves, Whiteness, halves, whiteness
from analysis.calibration.circles import centre_bias
from analysis.calibration.degenerate import complaints
from analysis.calibration.depth import DepthError, depth_error, working_volume
from analysis.calibration.estimate import Estimate, free_parameters
from analysis.calibration.lens_choice import LensTrial, choose_lens
from analysis.calibration.motion import Motion, Told, started, turned_about
from analysis.calibration.next_pose import Advice, advise
from analysis.calibration.observations import Observations, View, gather
from analysis.calibration.odd_views import mirrored, refocused
from analysis.calibration.robust import Adjusted, adjust_robustly
from analysis.calibration.start import start
from render.base.arrays import Bool, Float
from render.base.errors import InputError

FEWEST_FOR_CHOICE = 9
"""Views that the choice of a lens model needs, in three folds."""
DEFAULT_TERMS = 5
SCALE = 0.005
"""Of its way: what a stage may be off by itself."""


@dataclass(frozen=True)
class Known:
    """A camera that is calibrated already: intrinsics (4,), distortion, covariance (4 + terms, 4 + terms)."""

    intrinsics: Float
    distortion: Float
    covariance: Float | None
    """None: its errors were not told, and it is held."""


@dataclass(frozen=True)
class Request:
    """What is to be calibrated, and how."""

    size: tuple[int, int]
    """px, width and height."""
    lasers: int = 0
    terms: int | None = None
    """Distortion terms; None: chosen by held-out error."""
    warp: bool = True
    """The board may be bent."""
    nearest: float | None = None
    farthest: float | None = None
    """m, of the working volume; None: as far as the boards were."""
    most_tilt: float = np.radians(45.0)
    known: Known | None = None
    told: Told | None = None
    """Of the board's motion."""
    circle: float = 0.0
    """m, radius of the board's discs, whose centroids views have in place of corners; 0: corners."""


@dataclass(frozen=True)
class Calibrated:
    """The result, its checks and what to do next."""

    adjusted: Adjusted
    depth: tuple[DepthError, ...]
    """Of each laser."""
    faults: tuple[str, ...]
    halves: Halves | None
    whiteness: Whiteness
    lens_trials: tuple[LensTrial, ...]
    advice: Advice | None
    circle: float = 0.0
    """As of the request."""

    @property
    def estimate(self) -> Estimate:
        return self.adjusted.solution.estimate


def calibrate(views: Sequence[View], target: Float, request: Request) -> Calibrated:
    """views: each with eight corners or more; target (n, 2) m, all corners of the board.

    Views that are not of the camera as it was (`odd_views`) are left out and named. InputError: too few views, or the
    views do not determine what is asked for; it tells what to photograph.
    """
    extent = np.stack([target.min(axis=0), target.max(axis=0)])
    seen = centroids = gather(views, extent)
    known = request.known
    terms, trials = request.terms, list[LensTrial]()
    guess = start(
        views,
        request.size,
        DEFAULT_TERMS if terms is None else terms,
        request.lasers,
        None if known is None else (known.intrinsics, known.distortion),
    )
    if request.circle > 0.0:
        seen = _centred(centroids, guess, seen.names, request.circle, seen)
    faults = complaints(views, guess, request.size, camera=known is None)
    if known is None and terms is None and len(views) >= FEWEST_FOR_CHOICE:
        terms, trials = choose_lens(seen, guess)
        padded = np.zeros(terms)
        padded[: min(terms, 1)] = guess.distortion[: min(terms, 1)]
        guess = replace(guess, distortion=padded)
    if request.told is not None:
        if odd := _refocused_on_the_way(seen, guess, request):
            return _without(odd, views, target, request)
        guess, other_end = _carried(guess, request.told, seen.names, extent)
        ends = np.where(other_end[seen.view][:, None], extent.sum(axis=0) - seen.target, seen.target)
        seen, centroids = replace(seen, target=ends), replace(centroids, target=ends)
    free, prior = _free_and_prior(guess, request)
    try:
        adjusted = adjust_robustly(seen, guess, free, prior)
        if request.circle > 0.0:
            seen = _centred(centroids, adjusted.solution.estimate, adjusted.seen.names, request.circle, seen)
            adjusted = adjust_robustly(seen, guess, free, prior)
    except (InputError, np.linalg.LinAlgError) as error:
        raise InputError(
            "the views do not determine the calibration",
            found="; ".join(faults) if faults else str(error),
            cure="" if faults else "photograph the board at other tilts and distances",
        ) from None
    if odd := mirrored(views, adjusted, extent, request.size[0]) or refocused(adjusted):
        return _without(odd, views, target, request)
    estimate, covariance = adjusted.solution.estimate, adjusted.solution.covariance
    middle = np.append(0.5 * (target.min(axis=0) + target.max(axis=0)), 0.0)
    distance = (estimate.rotation @ middle + estimate.translation)[:, 2]
    nearest = float(distance.min()) if request.nearest is None else request.nearest
    farthest = float(distance.max()) if request.farthest is None else request.farthest
    if request.nearest is not None and request.farthest is not None and farthest <= nearest:
        raise InputError("the farthest distance is not beyond the nearest", found=f"{nearest:g} and {farthest:g} m")
    nearest, farthest = (
        (nearest, max(farthest, nearest * 1.01))
        if request.farthest is None
        else (min(nearest, farthest / 1.01), farthest)
    )
    volumes = [working_volume(estimate, laser, request.size, nearest, farthest) for laser in range(request.lasers)]
    typical = _typical_sigma(adjusted)
    depths = tuple(depth_error(estimate, covariance, one, typical[1]) for one in volumes if len(one.depth))
    usable = [one.volume for one in depths]
    faults += [
        f"the camera sees nothing of laser {one.laser} between {nearest:.3g} and {farthest:.3g} m: its depth error is "
        "not told; ask for other distances"
        for one in volumes
        if not len(one.depth)
    ]
    faults += _wrong_scale(estimate, covariance)
    if known is not None and known.covariance is None:
        faults.append("the camera came without its errors: sigmas and depth errors are those of an exact camera")
    advice = None
    if usable:
        advice = advise(
            estimate,
            adjusted.solution.information,
            adjusted.solution.free,
            target,
            request.size,
            usable,
            most_tilt=request.most_tilt,
            sigmas=(typical[0], typical[1] / np.sqrt(_density(adjusted.seen))),
        )
    return Calibrated(
        adjusted,
        depths,
        tuple(faults),
        halves(adjusted, usable, prior),
        whiteness(adjusted),
        tuple(trials),
        advice,
        request.circle,
    )


def _without(odd: dict[str, str], views: Sequence[View], target: Float, request: Request) -> Calibrated:
    """The calibration of the other views; odd: name of each that is left out, and the sentence."""
    found = calibrate([view for view in views if view.name not in odd], target, request)
    told = (*odd.values(), *found.adjusted.left_out)
    return replace(found, adjusted=replace(found.adjusted, left_out=told))


def _refocused_on_the_way(seen: Observations, guess: Estimate, request: Request) -> dict[str, str]:
    """As `refocused`, of boards that were carried, each taken as if it stood free.

    A motion shares what a moved focus does among all its views, and the odd ones are hidden by it. Nothing is told
    where the boards do not determine a camera without it.
    """
    try:
        return refocused(adjust_robustly(seen, guess, *_free_and_prior(guess, request)))
    except (InputError, np.linalg.LinAlgError):
        return {}


def _centred(
    centroids: Observations, estimate: Estimate, names: tuple[str, ...], radius: float, before: Observations
) -> Observations:
    """The images of the discs' centres, in the views of these names as an estimate of them has it, else as before."""
    number = np.array([names.index(name) if name in names else -1 for name in centroids.names])[centroids.view]
    posed = number >= 0
    pixel = before.pixel.copy()
    pixel[posed] = centroids.pixel[posed] - centre_bias(estimate, number[posed], centroids.target[posed], radius)
    return replace(centroids, pixel=pixel)


def _carried(guess: Estimate, told: Told, names: Sequence[str], extent: Float) -> tuple[Estimate, Bool]:
    """The guess with the motion that its poses show, and (views,) whose corners count from the other end."""
    group, given = told.of(names)
    empty = Motion(told.kind, group, given, np.zeros(0), np.zeros(3))
    other_end = turned_about(empty, guess.rotation)
    last = guess.translation + guess.rotation @ np.append(extent.sum(axis=0), 0.0)
    rotation = np.where(other_end[:, None, None], guess.rotation @ np.diag([-1.0, -1.0, 1.0]), guess.rotation)
    translation = np.where(other_end[:, None], last, guess.translation)
    guess = replace(guess, rotation=rotation, translation=translation)
    motion = started(told.kind, group, given, rotation, translation)
    return guess.with_motion(replace(motion, holds=told.holds)), other_end


def _wrong_scale(estimate: Estimate, covariance: Float) -> list[str]:
    """What a stage's way, against what it was told, says of the board: nothing else knows how large its squares are."""
    motion, own = estimate.motion, estimate.motion_slice
    if motion is None or motion.kind != "stage":
        return []
    way = float(np.linalg.norm(motion.parameters))
    unit = motion.parameters / way
    if abs(way - 1.0) < max(SCALE, 5.0 * float(np.sqrt(unit @ covariance[own, own] @ unit))):
        return []
    return [
        f"the board went {way:.4g} times as far as the stage was told: its squares are {1.0 / way:.4g} times as large "
        "as was said, or the stage's scale is off; measure the board"
    ]


def _free_and_prior(guess: Estimate, request: Request) -> tuple[Bool, Prior | None]:
    """Which parameters are estimated, and what is known of them before."""
    known = request.known
    if known is None:
        return free_parameters(guess, warp=request.warp), None
    if known.covariance is None:
        return free_parameters(guess, warp=request.warp, camera=False), None
    return free_parameters(guess, warp=request.warp), _prior(known.covariance, guess)


def _prior(covariance: Float, guess: Estimate) -> Prior:
    size = len(guess.shared)
    information = np.zeros((size, size))
    count = guess.camera_count
    spread = np.sqrt(np.maximum(np.diag(covariance), 1e-30))
    scaled = covariance / np.outer(spread, spread)
    np.fill_diagonal(scaled, 1.0)
    information[:count, :count] = np.linalg.inv(scaled) / np.outer(spread, spread)
    return Prior(guess.shared.copy(), information)


def _typical_sigma(adjusted: Adjusted) -> tuple[float, float]:
    """px of corners and of laser points, as the residuals have them."""
    seen = adjusted.seen
    used = seen.whitening[:, 0, 0] > 0.0
    line = seen.laser_weight[seen.laser_weight > 0.0]
    corner = np.abs(np.linalg.det(seen.whitening[used])) ** -0.5
    return float(np.median(corner)), float(np.median(1.0 / line)) if len(line) else 0.05


def _density(seen: Observations) -> float:
    """Laser points a scan line, as far as the lines reach."""
    used = seen.laser_weight > 0.0
    view, laser, pixel = seen.laser_view[used], seen.laser[used], seen.laser_pixel[used]
    place = np.take_along_axis(pixel, (1 - seen.along[used])[:, None], axis=1)[:, 0]
    same = (np.diff(view) == 0) & (np.diff(laser) == 0)
    reach = float(np.sum(np.abs(np.diff(place))[same]))
    return float(np.count_nonzero(same)) / reach if reach > 0.0 else 1.0
