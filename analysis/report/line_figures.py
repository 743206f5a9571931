"""Figures of one line: what the camera saw, the line against the truth, the profile."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.report.colour import MUTED, TRUTH, method_colour, method_name
from analysis.report.frame_result import Extraction, LaserResult
from analysis.report.style import WIDTH, figure, png_uri
from analysis.report.units import counted
from render.base.arrays import Float
from render.base.pose import invert, transform_points
from render.frame import LaserCurve

AXES_WIDTH = 6.2
"""inch, about: what labels leave of the page's width."""
LARGEST_PICTURE = 700
"""px a side of the downsampled camera image; half the page's width at its resolution."""
CROP = (12, 8)
"""Half width and half height of an enlarged place, px."""
BAND, BAND_LABEL = "#dce2e8", "±2 predicted sigma"
GAP = 4.0
"""Neighbouring true crossings farther apart than this many px are not joined."""
APART = 10.0
"""Times the usual step from point to point, beyond which the band of sigma is not drawn across."""
MARGIN = 0.04
"""Of what is shown, left free on either side of it."""


@dataclass(frozen=True)
class Place:
    """An enlarged place of the image."""

    name: str
    point: int


def display(image: NDArray[np.generic], white: float) -> Float:
    """(h, w) or (h, w, 3) DN -> 0 to 1 with a gamma of 1 / 3, so that dark surfaces show beside the bright line."""
    return np.asarray(np.cbrt(np.clip(image.astype(np.float64) / white, 0.0, 1.0)))


def block_maximum(image: Float, factor: int) -> Float:
    """The largest value of each block of `factor` x `factor` px: a thin line survives downsampling."""
    if factor == 1:
        return image
    h, w = (size // factor * factor for size in image.shape[:2])
    blocks = image[:h, :w].reshape(h // factor, factor, w // factor, factor, *image.shape[2:])
    return np.asarray(blocks.max(axis=(1, 3)))


def curve_pixels(curve: LaserCurve) -> Float:
    """(n, 2) u, v of the exact line."""
    index = curve.index.astype(np.float64)
    pair = (curve.position, index) if curve.axis == "rows" else (index, curve.position)
    return np.stack(pair, axis=1)


def joined(curve: LaserCurve, values: Float) -> tuple[Float, Float]:
    """Scan line and (n,) or (n, 2) values of the exact line, with NaN wherever the line is interrupted."""
    jump = (np.abs(np.diff(curve.index)) > 1) | (np.abs(np.diff(curve.position)) > GAP)
    at = np.flatnonzero(jump) + 1
    index = np.insert(curve.index.astype(np.float64), at, np.nan)
    return index, np.insert(values.astype(np.float64), at, np.nan, axis=0)


def places(extraction: Extraction) -> list[Place]:
    """The worst row, a typical one and the faintest, as far apart as they are; fewer when fewer are measured."""
    errors, points, line = extraction.errors, extraction.points, extraction.line
    e = np.abs(errors.position)
    measured = np.flatnonzero(np.isfinite(e))
    if len(measured) == 0:
        return []
    worst = int(measured[np.argmax(e[measured])])
    faint = int(measured[np.argmin(line.amplitude[points.index[measured], points.rank[measured]])])
    middling = measured[np.argsort(e[measured])][int(0.45 * len(measured)) : int(0.55 * len(measured)) + 1]
    apart = np.abs(points.index[middling, None] - points.index[[worst, faint]]).min(axis=1)
    typical = int(middling[np.argmax(apart)])
    both = worst == faint
    found = [Place("Worst and faintest row" if both else "Worst row", worst), Place("Typical row", typical)]
    found += [] if both else [Place("Faintest row", faint)]
    return [place for i, place in enumerate(found) if place.point not in [other.point for other in found[:i]]]


def camera_figure(laser: LaserResult, white: float) -> str:
    """The image as the sensor delivered it, and again with true and extracted line and the enlarged places marked."""
    assert laser.image is not None
    extraction = laser.extractions[0]
    h, w = laser.image.shape[:2]
    factor = max(1, -(-max(h, w) // LARGEST_PICTURE))
    picture = block_maximum(display(laser.image, white), factor)
    extent = (-0.5, picture.shape[1] * factor - 0.5, picture.shape[0] * factor - 0.5, -0.5)
    height = min(0.5 * WIDTH * h / w, 5.0) + 0.35
    with figure(height) as made:
        plain_axes, marked = made.subplots(1, 2)
        for axes in (plain_axes, marked):
            axes.imshow(picture, cmap="gray", vmin=0, vmax=1, extent=extent, interpolation="nearest")
            axes.set(xticks=[], yticks=[])
            axes.grid(False)
            axes.spines[:].set_visible(False)
        plain_axes.set_title("As the sensor delivered it")
        marked.set_title("True line, extracted line, enlarged places")
        _draw_line(marked, laser.curve, 2.6)
        pixel = extraction.points.pixel
        marked.plot(pixel[:, 0], pixel[:, 1], ".", ms=1.4, mew=0, color=method_colour(extraction.line.method))
        for number, place in enumerate(places(extraction), 1):
            u, v = pixel[place.point]
            marked.plot(u, v, "o", ms=9, mfc="none", mec="white", mew=0.9, clip_on=False)
            marked.annotate(
                str(number), (u, v), (8, -3), textcoords="offset points", color="white", fontsize=8, weight="bold"
            )
        marked.set(xlim=extent[:2], ylim=extent[2:])
        return png_uri(made)


def zoom_figure(laser: LaserResult, white: float) -> str | None:
    """The enlarged places, pixel by pixel; None when nothing was measured."""
    assert laser.image is not None
    extraction = laser.extractions[0]
    chosen = places(extraction)
    if not chosen:
        return None
    h, w = laser.image.shape[:2]
    picture = display(laser.image, white)
    pixel, position = extraction.points.pixel, extraction.errors.position
    with figure(1.8) as made:
        for number, (axes, place) in enumerate(zip(made.subplots(1, 3), chosen + [None] * 3, strict=False), 1):
            if place is None:
                axes.set_visible(False)
                continue
            u, v = pixel[place.point]
            half = max(CROP[0], int(abs(position[place.point])) + 4)
            u0, u1 = max(0, round(u) - half), min(w, round(u) + half + 1)
            v0, v1 = max(0, round(v) - half * CROP[1] // CROP[0]), min(h, round(v) + half * CROP[1] // CROP[0] + 1)
            crop = picture[v0:v1, u0:u1]
            extent = (u0 - 0.5, u1 - 0.5, v1 - 0.5, v0 - 0.5)
            # each place to its own brightest pixel: a faint line is to be seen as well
            top = max(float(crop.max()), 1e-3)
            axes.imshow(crop / top if crop.ndim == 3 else crop, cmap="gray", vmin=0, vmax=top, extent=extent)
            _draw_line(axes, laser.curve, 1.6)
            for other in reversed(laser.extractions):
                p, sigma = other.points.pixel, other.points.sigma_pixel
                near = (p[:, 0] > u0) & (p[:, 0] < u1) & (p[:, 1] > v0) & (p[:, 1] < v1)
                bars = {"xerr" if other.line.axis == "rows" else "yerr": 2 * sigma[near]}
                axes.errorbar(
                    p[near, 0], p[near, 1], fmt="o", ms=2.6, mec="white", mew=0.3, elinewidth=0.7,
                    color=method_colour(other.line.method), **bars,
                )  # fmt: skip
            axes.grid(False)
            axes.set(xlim=extent[:2], ylim=extent[2:])
            axes.locator_params(nbins=4)
            axes.set_title(f"{number}  {place.name}: {round(position[place.point], 3) + 0.0:+.3f} px")
        return png_uri(made)


def _draw_line(axes: Any, curve: LaserCurve, width: float) -> None:
    _, pixels = joined(curve, curve_pixels(curve))
    axes.plot(pixels[:, 0], pixels[:, 1], color=TRUTH, lw=width, alpha=0.85, solid_capstyle="butt")


def on_line(extraction: Extraction) -> NDArray[np.bool_]:
    """(n,) points that a plot has to show: those of the true line, or all that are measured where none is.

    A stray point of another scan line, or half an image off, would leave the line itself no room.
    """
    errors, valid = extraction.errors, extraction.points.valid
    of_line = valid & np.isfinite(errors.position) & ~errors.outlier
    return of_line if of_line.any() else valid


def _show(axes: Any, along: str, shown: Float, every: Float) -> None:
    """Bring the `shown` values of an axis into view, and tell how many of `every` are outside."""
    shown, every = shown[np.isfinite(shown)], every[np.isfinite(every)]
    if len(shown) == 0:
        return
    low, high = float(shown.min()), float(shown.max())
    margin = MARGIN * max(high - low, 1e-3 * abs(high), 1e-3)
    low, high = low - margin, high + margin
    (axes.set_xlim if along == "x" else axes.set_ylim)(low, high)
    _tell_outside(axes, int(np.count_nonzero((every < low) | (every > high))))


def _tell_outside(axes: Any, outside: int) -> None:
    if outside:
        axes.annotate(
            f"{counted(outside, 'point')} outside", (1.0, 1.0), (-3, -3), xycoords="axes fraction",
            textcoords="offset points", ha="right", va="top", fontsize=6.5, color=MUTED,
        )  # fmt: skip


def _band(at: Float, half: Float) -> tuple[Float, Float]:
    """(n,) places and half widths of a band in their order, with NaN where neighbours are far apart."""
    order = np.argsort(at, kind="stable")
    at, half = at[order].astype(np.float64), half[order]
    step = np.diff(at)
    usual = float(np.median(step[step > 0.0])) if np.any(step > 0.0) else np.inf
    gaps = np.flatnonzero(step > APART * usual) + 1
    return np.insert(at, gaps, np.nan), np.insert(half, gaps, np.nan)


def three_panel_figure(laser: LaserResult) -> str:
    """After the founding paper: the line's position, the depth found from it, and its difference from the truth."""
    curve, rows = laser.curve, laser.curve.axis == "rows"
    index: NDArray[Any]
    with figure(3.7) as made:
        position, depth, difference = made.subplots(1, 3, sharey=True, width_ratios=(1, 1, 1.25))
        for axes, values, scale in ((position, curve.position, 1.0), (depth, curve.depth_z, 1e3)):
            index, joined_values = joined(curve, values * scale)
            axes.plot(joined_values, index, color=TRUTH, lw=4, alpha=0.4, label="truth", solid_capstyle="butt")
        difference.axvline(0, color=TRUTH, lw=1.6, alpha=0.8)
        limit = robust_limit([e.errors.depth * 1e6 for e in laser.extractions])
        for extraction in reversed(laser.extractions):
            points, errors = extraction.points, extraction.errors
            index, colour = points.index, method_colour(extraction.line.method)
            along = points.pixel[:, 0 if rows else 1]
            label = method_name(extraction.line.method)
            position.plot(along, index, ".", ms=1.7, mew=0, color=colour, label=label)
            depth.plot(points.depth_z * 1e3, index, ".", ms=1.7, mew=0, color=colour)
            error = errors.depth * 1e6
            if extraction is laser.extractions[0]:
                sigma = np.where(np.isfinite(error), 2e6 * points.sigma_depth, np.nan)
                down, band = _band(index.astype(np.float64), sigma)
                difference.fill_betweenx(down, -band, band, color=BAND, lw=0, label=BAND_LABEL, zorder=0.9)
            faded = 1.0 if extraction is laser.extractions[0] else 0.3
            difference.plot(np.clip(error, -limit, limit), index, ".", ms=1.7, mew=0, color=colour, alpha=faded)
            off = np.abs(error) > limit
            difference.plot(np.sign(error[off]) * limit, index[off], "x", ms=3, mew=0.7, color=colour)
        difference.set_xlim(-1.05 * limit, 1.05 * limit)
        measured = [(e.points, on_line(e)) for e in laser.extractions]
        alongs = [points.pixel[:, 0 if rows else 1] for points, _ in measured]
        depths = [points.depth_z * 1e3 for points, _ in measured]
        indices = [points.index.astype(np.float64) for points, _ in measured]
        for axes, way, truth, of_each in (
            (position, "x", curve.position, alongs),
            (depth, "x", curve.depth_z * 1e3, depths),
            (difference, "y", curve.index.astype(np.float64), indices),
        ):
            seen = [of[here] for of, (_, here) in zip(of_each, measured, strict=True)]
            _show(axes, way, np.concatenate([truth, *seen]), of_each[0])
        if not position.yaxis_inverted():
            position.invert_yaxis()
        name = "u" if rows else "v"
        position.set(xlabel=f"{name} (px)", ylabel="image row v (px)" if rows else "image column u (px)")
        position.set_title("Position of the line")
        depth.set(xlabel="depth_z (mm)")
        depth.set_title("Depth")
        difference.set(xlabel="measured - true depth_z (µm)")
        difference.set_title("Difference")
        handles, labels = position.get_legend_handles_labels()
        order = [0, *range(len(labels) - 1, 0, -1)]  # the headline's method first
        position.legend([handles[i] for i in order], [labels[i] for i in order], loc="best", markerscale=5)
        difference.legend(loc="lower right", frameon=True, facecolor="white", edgecolor="none", framealpha=0.85)
        return png_uri(made)


def profile_figure(laser: LaserResult, T_camera_laser: Float) -> str:
    """The profile in the plane of the sheet, to scale, and below it each point's distance from the surface."""
    curve, first = laser.curve, laser.extractions[0]
    T_laser_camera = invert(T_camera_laser)
    true = transform_points(T_laser_camera, curve.point) * 1e3
    found = transform_points(T_laser_camera, first.points.camera) * 1e3
    colour = method_colour(first.line.method)
    every = np.concatenate([true[:, 1:], found[on_line(first)][:, 1:]])
    low, high = (every.min(axis=0), every.max(axis=0)) if len(every) else (np.zeros(2), np.ones(2))
    centre, span = (low + high) / 2, np.maximum(1.06 * (high - low), 1e-3)
    tall = float(np.clip(AXES_WIDTH * span[1] / span[0], 1.5, 3.3))
    with figure(tall + 1.9) as made:
        profile, error = made.subplots(2, 1, sharex=True, height_ratios=(tall, 1.1))
        _, path = joined(curve, true[:, 1:])
        profile.plot(path[:, 0], path[:, 1], color=TRUTH, lw=4, alpha=0.4, label="truth", solid_capstyle="butt")
        profile.plot(found[:, 1], found[:, 2], ".", ms=1.7, mew=0, color=colour, label=method_name(first.line.method))
        profile.set(ylabel="from the laser (mm)")
        profile.set_title("Profile in the plane of the laser sheet")
        profile.legend(loc="best", markerscale=5)
        signed, sigma = first.errors.off_surface * 1e6, first.errors.sigma_off_surface * 1e6
        limit = robust_limit([signed])
        across, band = _band(found[:, 1], 2 * sigma)
        error.fill_between(across, -band, band, color=BAND, lw=0, label=BAND_LABEL)
        error.axhline(0, color=TRUTH, lw=1.2)
        error.plot(found[:, 1], np.clip(signed, -limit, limit), ".", ms=1.6, mew=0, color=colour)
        off = np.abs(signed) > limit
        error.plot(found[off, 1], np.sign(signed[off]) * limit, "x", ms=3, mew=0.7, color=colour)
        error.set(ylim=(-1.05 * limit, 1.05 * limit), xlabel="across the fan (mm)", ylabel="off the surface (µm)")
        error.legend(loc="upper right")
        made.draw_without_rendering()
        box = profile.get_window_extent()
        half = max(span[0] / box.width, span[1] / box.height) / 2 * np.array([box.width, box.height])  # to scale
        profile.set(xlim=centre[0] + [-half[0], half[0]], ylim=centre[1] + [half[1], -half[1]])
        beyond = (np.abs(found[first.points.valid, 1:] - centre) > half).any(axis=1)
        _tell_outside(profile, int(np.count_nonzero(beyond)))
        return png_uri(made)


def robust_limit(values: list[Float]) -> float:
    """A symmetric axis limit that shows all but gross outliers; those are drawn as crosses on the edge."""
    every = np.abs(np.concatenate([np.zeros(0), *values]))
    every = every[np.isfinite(every)]
    if len(every) == 0 or every.max() == 0.0:
        return 1.0
    return float(min(every.max(), max(6.0 * np.median(every), 1.3 * np.percentile(every, 98)))) * 1.05
