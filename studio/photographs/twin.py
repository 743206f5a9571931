"""A twin of a real scanner: the sheet, blur, halo and noise of a project, fitted to what photographs show.

The closed forms of `twin_profile.py` and `twin_noise.py` are fitted to the photographs, less what a rehearsal of the
twin departs from them by. The sheet's width and the blur are told apart only where the sheet's changes along the line:
by depth, or by slant. Elsewhere the blur is the project's and the sheet takes what is left: the line's own width is
told. The surface is the project's, or, where the line is not where the project has it, taken to face the laser. All
Gaussians, as in the sensor's own model (`render/sensor/blur.py`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from scipy.ndimage import median_filter

from render.base.arrays import Float
from studio.photographs import twin_noise, twin_profile
from studio.photographs.line_profile import Transfer
from studio.photographs.twin_light import Numbers
from studio.photographs.twin_noise import Noise
from studio.photographs.twin_profile import Part, Shape
from studio.photographs.twin_seen import Seen, joined, light_above
from studio.project.project import Project

ROUNDS, TAKES = 4, 8
"""Rehearsals one after the other, and of the last twin, whose scatter is the sigma of what is told."""
MODEL, MODEL_PROCESSED = 0.002, 0.008
"""Relative sigma of the widths by what is left out, of raw images and of a camera's photographs: root mean square of
what rehearsals of the true numbers are off by on four and five scanners that no twin is judged by (`OTHERS` of
`tests/validation/twin_scenes.py`), 0.0016 and 0.0076."""
NOISE, NOISE_PROCESSED = 0.06, 0.27
"""The same of the noise in one bin of light, beyond chance: 0.058 and 0.27."""
LOUDER = 2.0
"""Times the variance of a sensor's noise, by which is told how much of it comes through."""
LEAST_PASSED = 0.02
"""Share of the noise that comes through, below which none does."""
SMOOTH = 5
"""Bins of light over which the share of the noise that comes through is smooth."""


@dataclass(frozen=True)
class Told:
    """A number with its standard deviation; `why` where the photographs do not tell it, and it is the project's."""

    value: float
    sigma: float
    why: str = ""


@dataclass(frozen=True)
class Twin:
    """What was fitted. Widths in px of the image, levels in electrons; scale: of the sheet's width in the project."""

    scale: Told
    sheet_px: Told
    line_px: Told
    """Sigma of sheet and blur together, which is told where the two are not."""
    blur_px: Told
    halo: Told
    halo_px: Told
    gain: Told
    """DN/e-, of a photograph those of its light."""
    read_noise: Told
    scatter: Told
    """Of the light itself, relative: speckle and PRNU."""
    alike: Told
    """Correlation of the noise of neighbouring scan lines."""
    saturation: Told
    """DN."""
    ambient: Told
    peak: Told
    """Of the laser alone, in the brightest pixel of a scan line, median."""
    scan_lines: int


@dataclass(frozen=True)
class Fit:
    """A twin with all that the next rehearsal is compared by."""

    twin: Twin
    shape: Shape
    noise: Noise | None
    """None: not told."""
    edges: Float | None
    """DN by which pixels were sorted."""


@dataclass(frozen=True)
class Departed:
    """By how much a rehearsal departs from the closed forms: of profiles, and of (k,) variances."""

    profiles: dict[int, tuple[Float, Float]]
    """By place of the stretch."""
    noise: Transfer | None
    """Of the rehearsal; None: too few pixels tell it."""
    values: Float
    """(3,) of a `Noise`, by which it was."""
    passed: Float
    """(k,) share of the sensor's noise that comes through."""


def fitted(
    project: Project,
    seen: Seen,
    numbers: Numbers,
    departed: Departed | None = None,
    like: Fit | None = None,
    rough: bool = False,
) -> Fit:
    """The twin's numbers, of closed forms less what a rehearsal departed by.

    like: a fit that says what is told. rough: the noise is the project's as yet. InputError: as the two fits.
    """
    sensor, pitch = project.sensor, project.scene.camera.pixel_pitch
    parts = twin_profile.parts_of(seen)
    if departed is not None:
        parts = twin_profile.less(parts, departed.profiles)
    start = np.array([1.0, (sensor.blur_sigma / pitch) ** 2, sensor.halo, sensor.halo_sigma / pitch])
    raw = sensor.processing is None
    shape = twin_profile.fit_shape(parts, start, raw, None if like is None else like.shape)
    rehearsed = None if departed is None else departed.noise
    found = twin_noise.transfer(seen, shape.best, None if rehearsed is None else rehearsed.edges)
    noise = None
    if found is not None and not rough:
        usual, left_out = found, np.zeros_like(found.variance)
        if departed is not None and rehearsed is not None:
            left_out = (NOISE if raw else NOISE_PROCESSED) * found.variance / departed.passed
            expected = twin_noise.expected(departed.values, rehearsed, numbers.black)
            usual = twin_noise.less(found, rehearsed.variance, departed.passed, expected)
        own = sensor.speckle != "off" or not raw
        noise = twin_noise.fit_noise(
            usual, numbers.black, sensor.prnu, own, left_out, None if like is None else like.noise
        )
    twin = _told(project, seen, numbers, parts, shape, noise, found)
    return Fit(twin, shape, noise, None if found is None else found.edges)


def _told(
    project: Project,
    seen: Seen,
    numbers: Numbers,
    parts: list[Part],
    shape: Shape,
    noise: Noise | None,
    found: Transfer | None,
) -> Twin:
    """Two fits as numbers for a person."""
    sensor, pitch, p, sigma = project.sensor, project.scene.camera.pixel_pitch, shape.values, shape.sigmas
    whole = seen.whole
    scale, usual = float(np.sqrt(p[0])), float(np.median(whole.sheet))
    scale_sigma, blur = float(0.5 * sigma[0] / scale), float(np.sqrt(p[1]))
    line = float(np.hypot(scale * usual, blur))
    apart = "" if shape.apart else "the sheet is about as wide everywhere: the two cannot be told apart"
    haloed = "" if shape.haloed else "no halo stands out"
    if sensor.processing is not None:
        haloed = "what a camera does to contours hides it"
    gain, read_noise, scatter = _noise_told(project, noise, numbers)
    ground = np.median(whole.stretch.values[:, [0, 1, -2, -1]], axis=1)
    light = light_above(whole.stretch.values)
    nearest = np.take_along_axis(whole.stretch.distance, np.abs(whole.stretch.distance).argmin(axis=1)[:, None], axis=1)
    shares = np.median([np.median(twin_profile.expected(p, one, nearest[:, 0])) for one in parts])
    peak = float(np.median(light)) * float(shares) / gain.value
    ambient = max(float(np.median(ground)) - numbers.black, 0.0) / gain.value
    relative = gain.sigma / gain.value
    none = "no number is shared by so many pixels: nothing is saturated"
    return Twin(
        Told(scale, scale_sigma),
        Told(scale * usual, scale_sigma * usual),
        Told(line, shape.line / (2.0 * line)),
        Told(blur, 0.0 if apart else float(0.5 * sigma[1] / max(blur, 1e-3)), apart),
        Told(float(p[2]), float(sigma[2]), haloed),
        Told(float(p[3]) if shape.haloed else sensor.halo_sigma / pitch, float(sigma[3]), haloed),
        gain,
        read_noise,
        scatter,
        Told(0.0 if found is None else found.alike, np.nan if found is None else found.alike_sigma),
        Told(numbers.top, 0.0, none) if seen.saturation is None else Told(seen.saturation, 0.0),
        Told(ambient, ambient * relative),
        Told(peak, peak * relative),
        seen.count,
    )


def _noise_told(project: Project, noise: Noise | None, numbers: Numbers) -> tuple[Told, Told, Told]:
    """Gain, read noise and the light's own scatter."""
    sensor, why = project.sensor, ""
    if noise is None:
        why = "too few pixels above the lowest number"
    elif not twin_noise.counted(noise):
        why = "speckle hides the noise of counting" if sensor.processing is None else "the camera's processing hides it"
    if why or noise is None:
        return Told(numbers.gain, 0.0, why), Told(sensor.read_noise, 0.0, why), Told(sensor.prnu, 0.0, why)
    p, sigma = noise.values, noise.sigmas
    gain = Told(float(p[0]), float(sigma[0]))
    read = Told(float(np.sqrt(p[1]) / p[0]), float(0.5 * sigma[1] / np.sqrt(max(p[1], sigma[1], 1e-18)) / p[0]))
    if p[1] <= 0.5 * sigma[1] and (sensor.read_noise * p[0]) ** 2 < p[1] + 2.0 * sigma[1]:
        read = Told(sensor.read_noise, 0.0, "too little beside that of the light")
    scatter = Told(float(np.sqrt(p[2])), float(0.5 * sigma[2] / max(np.sqrt(p[2]), 1e-9)))
    if not noise.scattered:
        why = "too little beside that of counting"
        scatter = Told(sensor.prnu, 0.0, why if sensor.speckle == "off" else "speckle is beside it")
    return gain, read, scatter


Rehearse = Callable[[Twin, int, float], Seen]
"""A twin, a seed, and times that the variance of its noise is -> what its photographs would have shown."""


def by_rehearsal(project: Project, seen: Seen, numbers: Numbers, rehearse: Rehearse) -> Twin:
    """The twin whose own photographs show what the photographs show; sigmas by the scatter of its rehearsals."""
    seen = replace(seen, cuts=twin_profile.cuts_of(seen))
    fit = fitted(project, seen, numbers, rough=True)
    for k in range(ROUNDS):
        takes = [rehearse(fit.twin, k, 1.0)]
        fit = fitted(project, seen, numbers, _departed(project, fit, seen, takes, numbers, rehearse))
    takes = [rehearse(fit.twin, ROUNDS + k, 1.0) for k in range(TAKES)]
    departed = _departed(project, fit, seen, takes, numbers, rehearse)
    last = fitted(project, seen, numbers, departed)
    again = [fitted(project, one, numbers, departed, last).twin for one in takes]
    twin = _with_scatter(last.twin, again, sum(one.count for one in takes) / (TAKES * seen.count))
    return _with_left_out(twin, last, MODEL if project.sensor.processing is None else MODEL_PROCESSED)


def _with_left_out(twin: Twin, fit: Fit, relative: float) -> Twin:
    """The twin less sure by what rehearsals leave out; relative: of the line's width."""
    line, sheet = twin.line_px.value, twin.sheet_px.value
    # of the line's variance; what of it is the blur's is as unsure in px^2
    model = relative * line**2
    # as likely anywhere as far as the widest or narrowest line of the same shape, to either side
    either = fit.shape.unlike / math.sqrt(3.0)
    of_line, of_sheet = (math.hypot(relative * one, either / (2.0 * one)) for one in (line, sheet))
    twin = replace(
        twin,
        scale=_less_sure(twin.scale, of_sheet / sheet * twin.scale.value),
        sheet_px=_less_sure(twin.sheet_px, of_sheet),
        line_px=_less_sure(twin.line_px, of_line),
        blur_px=_less_sure(twin.blur_px, model / max(twin.blur_px.value, 1e-3)),
        # as much of the light may be taken for the line's in place of the halo's
        halo=_less_sure(twin.halo, relative),
        halo_px=_less_sure(twin.halo_px, relative / max(twin.halo.value, relative) * twin.halo_px.value),
    )
    if fit.noise is None or twin.gain.why:
        return twin
    gain = twin.gain.value
    share, dark = fit.noise.left_out[0] / gain, fit.noise.left_out[1]
    least = math.sqrt(max(float(fit.noise.values[1]), dark, 1e-18))
    read = math.hypot(0.5 * dark / least / gain, share * twin.read_noise.value)
    return replace(
        twin,
        gain=_less_sure(twin.gain, share * gain),
        read_noise=_less_sure(twin.read_noise, read),
        ambient=_less_sure(twin.ambient, share * twin.ambient.value),
        peak=_less_sure(twin.peak, share * twin.peak.value),
    )


def _less_sure(told: Told, sigma: float) -> Told:
    """With another sigma on top, where it is told."""
    return told if told.why else replace(told, sigma=math.hypot(told.sigma, sigma))


def _departed(
    project: Project, fit: Fit, seen: Seen, takes: list[Seen], numbers: Numbers, rehearse: Rehearse
) -> Departed:
    """What rehearsals of a fit's twin have beside the closed forms of it."""
    both, twin = joined(takes, seen), fit.twin
    profiles = twin_profile.departures(fit.shape.values, twin_profile.parts_of(both))
    gain = twin.gain.value
    values = np.array([gain, (gain * twin.read_noise.value) ** 2, twin.scatter.value**2])
    found = None if fit.edges is None else twin_noise.transfer(both, fit.shape.values, fit.edges)
    if found is None:
        return Departed(profiles, None, values, np.ones(0))
    passed = np.ones_like(found.variance)
    if project.sensor.processing is not None:
        louder = [rehearse(twin, k, LOUDER) for k in range(min(len(takes), 2))]
        loud = twin_noise.transfer(joined(louder, seen), fit.shape.values, fit.edges)
        usual = twin_noise.basis(found, numbers.black)[:, :2] @ values[:2]
        if loud is not None:
            ratio = (loud.variance - found.variance) / ((LOUDER - 1.0) * usual)
            good = np.isfinite(ratio)
            ratio = np.interp(np.arange(len(ratio)), np.flatnonzero(good), ratio[good]) if good.any() else passed
            passed = np.clip(median_filter(ratio, SMOOTH, mode="nearest"), LEAST_PASSED, None)
    return Departed(profiles, found, values, passed)


def _with_scatter(twin: Twin, again: list[Twin], share: float) -> Twin:
    """The twin with sigmas by the scatter of rehearsals, each of a share of its scan lines."""
    changes: dict[str, Any] = {}
    for one in fields(twin):
        told = getattr(twin, one.name)
        if isinstance(told, Told) and not told.why and told.sigma > 0.0:
            values = [getattr(other, one.name).value for other in again]
            # what the mean of the rehearsals is not sure of comes on top
            sigma = float(np.std(values, ddof=1)) * np.sqrt(share + 1.0 / len(again))
            changes[one.name] = replace(told, sigma=sigma)
    return replace(twin, **changes)
