"""Figures of a frame, an image and errors for a notebook: matplotlib's own, without its global state."""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.line.result import Line
from analysis.report.colour import TRUTH, method_colour, method_name
from analysis.report.style import RC
from analysis.report.units import micrometres, millimetres
from render.base.errors import InputError
from render.output.tone_mapping import Picture
from studio.notebook.checks import check_laser
from studio.scan.frame_views import View, picture, views

if TYPE_CHECKING:
    from studio.notebook.frame import RenderedFrame
    from studio.notebook.measuring import DevelopedImage, PointErrors

WIDTH = 7.0
"""inch."""
MOST_BINS = 60


class NotebookFigure(Figure):
    """A figure that a notebook shows by itself, though pyplot has never heard of it."""

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=120)
        return buffer.getvalue()


def frame_figure(frame: RenderedFrame, kind: str | None, laser: int) -> Figure:
    """InputError: the frame has no such view."""
    scene = frame.project.scene
    found = [view for view in views(scene, frame) if view.kind != "image"]
    names = list(dict.fromkeys(view.kind for view in found))
    if kind is None:
        kind = "light" if "light" in names else names[0]
    if kind not in names:
        raise InputError("the frame does not have that", where="show: kind", found=kind, allowed=", ".join(names))
    which = check_laser(laser, scene) if kind in ("laser", "reflected") else 0
    chosen = next(view for view in found if view.kind == kind and view.laser == which)
    title = chosen.label
    if kind == "depth" and frame.truth is not None and np.isfinite(frame.truth.depth_z).any():
        near, far = np.nanmin(frame.truth.depth_z), np.nanmax(frame.truth.depth_z)
        title = f"{title}, {millimetres(float(near))} (dark) to {millimetres(float(far))} (bright)"
    return _picture_figure(picture(chosen, scene, frame, [], bright=True), title)


def image_figure(image: DevelopedImage, line: Line | None) -> Figure:
    """The line's valid peaks are drawn over it."""
    shown = picture(View("image", 0, "Image", "DN"), image.project.scene, image.frame, [image], bright=True)
    name = image.project.scene.lasers[image.laser].name
    found = "" if line is None else f", and the line by {method_name(line.method)}"
    made = _picture_figure(shown, f"Image of {name}, {image.bits} bit{found}")
    if line is not None:
        pixel, _, _ = line.pixels()
        made.axes[0].plot(pixel[:, 0], pixel[:, 1], ".", ms=2, color=method_colour(line.method))
    return made


def errors_figure(errors: PointErrors) -> Figure:
    """Depth error by scan line, and beside it how the errors are spread."""
    points, measured = errors.points, errors.depth_z
    error = 1e6 * errors.depth
    wrong = errors.outlier & np.isfinite(error)
    colour = method_colour(points.line.method)
    with matplotlib.rc_context(RC):
        made = NotebookFigure(figsize=(WIDTH, 3.0), layout="constrained")
        along, spread = made.subplots(1, 2, sharey=True, width_ratios=(3, 1))
        along.plot(points.index[~wrong], error[~wrong], ".", ms=2.5, color=colour)
        along.axhline(0.0, color=TRUTH, lw=1)
        what = "row" if points.axis == "rows" else "column"
        hidden = f"; {int(wrong.sum())} outliers are not shown" if wrong.any() else ""
        along.set(xlabel=f"image {what}{hidden}", ylabel="depth error (µm), + too far")
        along.set_title(
            f"RMSE {micrometres(measured.rmse)}, bias {micrometres(measured.bias)}, "
            f"robust sigma {micrometres(measured.robust_sigma)}, "
            f"{errors.completeness:.1%} of the line measured"
        )
        kept = error[np.isfinite(error) & ~wrong]
        if len(kept):
            spread.hist(
                kept, bins=min(MOST_BINS, max(8, math.isqrt(len(kept)))), orientation="horizontal", color=colour
            )
        spread.axhline(0.0, color=TRUTH, lw=1)
        spread.set(xlabel="points")
    return made


def _picture_figure(shown: Picture | None, title: str) -> Figure:
    if shown is None:
        raise InputError("there is nothing to show", where=title)
    height, width = shown.shape
    with matplotlib.rc_context({**RC, "axes.grid": False}):
        made = NotebookFigure(figsize=(WIDTH, WIDTH * min(height / width, 2.0) + 0.4), layout="constrained")
        axes = made.subplots()
        axes.imshow(_rgb(shown), interpolation="nearest" if width < 800 else "antialiased")
        axes.set(xlabel="u (px)", ylabel="v (px)", title=title)
    return made


def _rgb(shown: Picture) -> NDArray[np.uint8]:
    """(h, w, 3) of 0xffrrggbb."""
    return np.stack([(shown >> np.uint32(shift)) & np.uint32(255) for shift in (16, 8, 0)], axis=2).astype(np.uint8)
