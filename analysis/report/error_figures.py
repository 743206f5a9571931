"""Figures of the errors as a whole: where they are, how they are spread, how they go from step to step."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.measures import robust_sigma
from analysis.report.colour import ACCENT, DIVERGING, INK, MUTED, TRUTH, method_colour, method_name
from analysis.report.frame_result import FrameResult
from analysis.report.model import ReportInput
from analysis.report.picture import without_margins
from analysis.report.style import WIDTH, figure, image_uri, png_uri, short
from analysis.report.units import counted, micrometres
from render.base.arrays import Float

SCENE_ASPECT = 1.55
"""Width over height of the scene picture, at least."""
MAP_WIDTH = 4.5
"""inch, of the cloud beside its histogram."""
WIDEST = 1400
"""px; pictures are scaled down to this."""
USUAL_SIGMAS = 4.0
"""Robust sigmas from their median to which errors spread without outliers."""
REACH = 1.5
"""Of the axis of errors, in the limit of their colours."""


def nice_limit(error: Float) -> float:
    """1, 2 or 5 times a power of ten that holds 98 % of the errors, m; 1 um when there are none."""
    size = np.abs(error[np.isfinite(error)])
    return _rounded_up(float(np.percentile(size, 98)) if len(size) else 0.0)


def error_limit(error: Float) -> float:
    """The same of errors some of which may be gross: on their scale all others would be in one bar and one colour.

    It need not hold them while nine of ten errors, and all that the usual ones spread to, are within it.
    """
    finite = error[np.isfinite(error)]
    sigma = robust_sigma(finite)
    if not sigma > 0.0:
        return nice_limit(error)
    usual = max(abs(float(np.median(finite))) + USUAL_SIGMAS * sigma, float(np.percentile(np.abs(finite), 90)))
    return min(nice_limit(error), _rounded_up(usual))


def _rounded_up(top: float) -> float:
    if top <= 0.0:
        return 1e-6
    power = 10.0 ** np.floor(np.log10(top))
    return float(next(step * power for step in (1, 2, 5, 10) if step * power >= top * (1 - 1e-9)))


def cropped(path: Path) -> NDArray[np.uint8]:
    """(h, w, 3) picture without its white margins."""
    from PIL import Image

    picture = Image.fromarray(without_margins(np.asarray(Image.open(path).convert("RGB"))))
    if picture.width > WIDEST:
        picture = picture.resize((WIDEST, picture.height * WIDEST // picture.width), Image.Resampling.LANCZOS)
    return np.asarray(picture)


def scene_figure(path: Path) -> str:
    """The scene picture, on a canvas that leaves room for text on its page."""
    picture = cropped(path)
    missing = int(SCENE_ASPECT * picture.shape[0]) - picture.shape[1]
    if missing > 0:
        sides = (missing // 2, missing - missing // 2)
        picture = np.pad(picture, ((0, 0), sides, (0, 0)), constant_values=255)
    return image_uri(picture)


def error_map_figure(path: Path, error: Float, limit: float, sigma: float) -> str:
    """The coloured cloud, and beside it the histogram of the same errors, whose bars are the scale of the colours."""
    import matplotlib
    from matplotlib.colors import Normalize

    picture = cropped(path)
    colours, norm = matplotlib.colormaps[DIVERGING], Normalize(-limit * 1e6, limit * 1e6)
    tall = float(np.clip(MAP_WIDTH * picture.shape[0] / picture.shape[1], 2.4, 3.6))
    with figure(tall + 0.3) as made:
        cloud, histogram = made.subplots(1, 2, width_ratios=(MAP_WIDTH, WIDTH - MAP_WIDTH))
        cloud.imshow(picture, interpolation="antialiased")
        cloud.set_axis_off()
        cloud.set_title("Distance of the points from the part")
        finite = error[np.isfinite(error)] * 1e6
        edges = np.linspace(-limit * REACH * 1e6, limit * REACH * 1e6, 61)
        counts, _ = np.histogram(np.clip(finite, edges[0], edges[-1]), edges)
        middle = (edges[1:] + edges[:-1]) / 2
        histogram.barh(
            middle, counts, height=np.diff(edges), color=colours(norm(middle)), edgecolor="#9aa5b0", linewidth=0.3
        )
        if len(finite) and sigma > 0:
            normal = np.exp(-0.5 * ((middle - np.median(finite)) / (sigma * 1e6)) ** 2)
            normal *= len(finite) * (edges[1] - edges[0]) / (sigma * 1e6 * np.sqrt(2 * np.pi))
            histogram.plot(normal, middle, color=INK, lw=0.9)
        histogram.axhline(0, color=TRUTH, lw=1.2)
        histogram.set(ylabel="surface error (µm), + is too far", xlabel="points", ylim=(edges[0], edges[-1]))
        histogram.set_title("Distribution and scale")
        for side, told in zip((1, -1), beyond(error, REACH * limit), strict=True):
            histogram.annotate(
                told, (1.0, max(side, 0)), (0, -10 * side), xycoords="axes fraction", textcoords="offset points",
                ha="right", va="top" if side > 0 else "bottom", fontsize=6.5, color=INK,
            )  # fmt: skip
        return png_uri(made)


def beyond(error: Float, reach: float) -> tuple[str, str]:
    """How many errors lie above and below an axis to +-reach, m, and how far the farthest; empty: none does."""
    far = error[np.isfinite(error) & (np.abs(error) > reach)]
    return _told_beyond(far[far > 0.0], "+"), _told_beyond(far[far < 0.0], "\u2212")


def _told_beyond(far: Float, sign: str) -> str:
    if len(far) == 0:
        return ""
    return f"{counted(len(far), 'point')} beyond, to {sign}{micrometres(float(np.abs(far).max()))}"


def steps_figure(report: ReportInput, shown: int) -> str:
    """Depth error and completeness from step to step, counted from 1; `shown`: the step shown in detail, from 0."""
    steps, shown = [one.step + 1 for one in report.record.steps], shown + 1
    style: dict[str, Any] = {"lw": 1.1, "marker": "o", "ms": 2.6 if len(steps) < 60 else 0}
    with figure(2.9) as made:
        error, rows = made.subplots(2, 1, sharex=True, height_ratios=(1.6, 1))
        for i, laser in enumerate(report.scene.lasers):
            results = [one.lasers[i] for one in report.record.steps]
            line = ("-", "--", ":", "-.")[i % 4]
            name = "" if len(report.scene.lasers) == 1 else f", {short(laser.name, 16)}"
            colour = method_colour(report.record.chosen(i).sums.method)
            rmse = [result.rmse * 1e6 for result in results]
            bias = [result.bias * 1e6 for result in results]
            error.plot(steps, rmse, ls=line, color=colour, label=f"RMSE{name}", **style)
            error.plot(steps, bias, ls=line, color=MUTED, label=f"bias{name}", **style)
            rows.plot(steps, [100 * result.completeness for result in results], ls=line, color=ACCENT, **style)
        for axes in (error, rows):
            axes.axvline(shown, color=INK, lw=0.6, ls=":")
        rows.xaxis.get_major_locator().set_params(integer=True)
        error.axhline(0, color=TRUTH, lw=1)
        late = shown > (steps[0] + steps[-1]) / 2
        rows.annotate(
            "shown in detail", (shown, 0), (-3 if late else 3, 3), textcoords="offset points",
            ha="right" if late else "left", fontsize=6.5, color=MUTED,
        )  # fmt: skip
        error.set(ylabel="depth error (µm)")
        error.legend(loc="best", ncols=2).set_in_layout(False)
        rows.set(ylabel="complete (%)", xlabel="step", ylim=(0, 104))
        return png_uri(made)


def methods_figure(frame: FrameResult, laser: int) -> str:
    """Distribution of the position error of several methods on the same image."""
    extractions = frame.lasers[laser].extractions
    errors = [np.abs(e.errors.position[np.isfinite(e.errors.position)]) for e in extractions]
    with figure(2.1) as made:
        axes = made.subplots()
        for extraction, error in zip(extractions, errors, strict=True):
            if len(error):
                level = (np.arange(len(error)) + 1) / len(error) * 100
                colour = method_colour(extraction.line.method)
                axes.plot(np.sort(error), level, color=colour, lw=1.5, label=method_name(extraction.line.method))
        positive = np.concatenate([np.zeros(0), *errors])
        if np.any(positive > 0):
            axes.set_xscale("log")
            axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
            axes.set_xlim(left=max(1e-4, float(np.percentile(positive[positive > 0], 2))))
        axes.set(xlabel="size of the position error (px)", ylabel="of the points (%)", ylim=(0, 101))
        axes.legend(loc="best")
        return png_uri(made)
