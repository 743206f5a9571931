"""Points of a part by their deviation from the nominal, as a map with tolerance bands, callouts and a histogram."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.deviation import callouts, far_off, off_the_part
from analysis.report.colour import INK, MUTED
from analysis.report.error_figures import nice_limit
from analysis.report.labels import label_places, text_size
from analysis.report.style import figure
from render.base.arrays import Float

BANDS = ("#2166ac", "#67a9cf", "#d1e5f0", "#a6d96a", "#a6d96a", "#fddbc7", "#ef8a62", "#b2182b")
"""Below the tolerance in blue, within in green, above in red: also told apart by their lightness."""
EVEN_BANDS = (*BANDS[:3], "#c4c4c4", "#c4c4c4", *BANDS[5:])
"""Of a range that no tolerance parts: nothing in it is right or wrong."""
MOST_DRAWN = 120_000
MARGIN = 0.06
"""Of the part's width, on either side of it."""
CALLOUTS = 5
LABEL_PT = 7.0
FRAME = 0.65
"""What the frame of a callout adds to its text, over the font's size."""


@dataclass(frozen=True)
class DeviationMap:
    """What is drawn; m."""

    points: Float
    """(n, 3)."""
    value: Float
    """(n,) positive: too much material."""
    towards: Float
    """(3,) from the part to whom it is shown."""
    lower: float | None = None
    upper: float | None = None
    """Limits of the tolerance; None: none are given."""
    no_place: NDArray[np.bool_] | None = None
    """(n,) as of `tells_no_place`; None: of none is it known."""


FALSE = 0.01
"""Share of the points on either side that may be false: beyond twice the distance to all others there is no band."""


def levels(value: Float, lower: float | None, upper: float | None) -> Float:
    """(9,) edges of the bands, m: two within the tolerance about its middle, three beyond each of its limits."""
    if lower is None or upper is None or not upper > lower:
        limit = nice_limit(value)
        return np.linspace(-limit, limit, len(BANDS) + 1)
    least, most = lower, upper
    if len(value):
        # false points lie anywhere: they are in the outermost bands, and do not say how far these reach
        low, middle, high = np.quantile(value, [FALSE, 0.5, 1.0 - FALSE]).tolist()
        least = max(float(value.min()), middle - 2.0 * (middle - low))
        most = min(float(value.max()), middle + 2.0 * (high - middle))
    reach = max(lower - least, most - upper, 0.5 * (upper - lower)) * (1.0 + 1e-9)
    beyond = reach * np.array([0.25, 0.6, 1.0])
    return np.concatenate([lower - beyond[::-1], [lower, 0.5 * (lower + upper), upper], upper + beyond])


def draw(what: DeviationMap, seed: int = 0) -> Any:
    """A matplotlib figure; call within nothing else. Points beyond MOST_DRAWN are drawn by chance."""
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.ticker import MaxNLocator

    across, up = _axes(what.towards)
    place = 1e3 * np.column_stack([what.points @ across, what.points @ up])
    low, high = _extent(place, what.value)
    place -= low
    edges = levels(what.value, what.lower, what.upper)
    bands = EVEN_BANDS if what.lower is None or what.upper is None else BANDS
    colours, norm = ListedColormap(list(bands)), BoundaryNorm(edges * 1e6, len(bands))
    wide, tall = high - low
    if tall > wide:  # lying down it is larger on a page that is wider than this is high
        place, wide, tall = np.column_stack([place[:, 1], wide - place[:, 0]]), tall, wide
    height = float(np.clip(4.6 * max(tall, 0.36 * wide) / max(wide, 1e-9), 2.2, 5.6)) + 0.5
    with figure(height) as made:
        drawing, bars = made.subplots(1, 2, width_ratios=(4.6, 1.5))
        kept = np.random.default_rng(seed).permutation(len(place))[:MOST_DRAWN]
        size = float(np.clip(6000.0 / max(len(kept), 1), 0.4, 12.0))
        clipped = np.clip(what.value * 1e6, edges[0] * 1e6, edges[-1] * 1e6)
        drawing.scatter(*place[kept].T, c=clipped[kept], s=size, cmap=colours, norm=norm, linewidths=0)
        drawing.set_aspect("equal")
        # room for the callouts about a map that is low
        pad = 0.5 * max(0.36 * wide - tall, 0.1 * tall)
        drawing.set_ylim(-pad, tall + pad)
        margin = MARGIN * max(wide, 1.0)  # mm, of a single point as well
        drawing.set_xlim(-margin, wide + margin)
        beyond = int(np.any((place < (-margin, -pad)) | (place > (wide + margin, tall + pad)), axis=1).sum())
        drawing.grid(False)
        drawing.set(xlabel="mm", ylabel="mm")
        drawing.xaxis.set_major_locator(MaxNLocator(max(1, min(8, round(8.0 * wide / max(tall, 1e-9)))), integer=True))
        named, apart, stray = _of_the_part(what, place)
        drawing.set_title(
            f"Deviation from the nominal surface, + outside (too much)\n"
            f"A number is the median of a place{_without_number(stray, len(place) - len(named), beyond)}"
        )
        fine = np.linspace(edges[0], edges[-1], 49) * 1e6
        counts, _ = np.histogram(clipped, fine)
        middle = (fine[1:] + fine[:-1]) / 2.0
        bars.barh(middle, counts, height=np.diff(fine), color=colours(norm(middle)), edgecolor="none")
        for limit in (what.lower, what.upper):
            if limit is not None:
                bars.axhline(limit * 1e6, color=INK, lw=0.8, ls="--")
        bars.axhline(0.0, color=MUTED, lw=0.6)
        bars.set(ylabel="deviation (µm)", xlabel="points", ylim=(fine[0], fine[-1]))
        bars.set_title("Bands")
        made.canvas.draw()  # where things are is known from here on
        _point_at(drawing, what, place, named, apart)
        made.canvas.draw()
        return made


def _without_number(stray: int, count: int, beyond: int) -> str:
    # on a line of its own: the title has no more room beside the bands
    left = f",\n{beyond} lie{'s' * (beyond == 1)} beyond the picture" if beyond else ""
    if count == 0:
        return left
    return f", {count} stray {'or unsure ' * (count > stray)}point{' has' if count == 1 else 's have'} none{left}"


def _extent(place: Float, value: Float) -> tuple[Float, Float]:
    """(2,) and (2,): where the part begins and ends, of which a few points far off would make a speck.

    More of them than may be false are a place of the part, such as an end that is bent away.
    """
    if len(place) == 0:
        return np.zeros(2), np.ones(2)
    near = ~far_off(value)
    part = place[near] if near.any() else place
    low, high = np.quantile(place, [FALSE, 1.0 - FALSE], axis=0)
    return np.minimum(part.min(axis=0), low), np.maximum(part.max(axis=0), high)


def _of_the_part(what: DeviationMap, place: Float) -> tuple[NDArray[np.int64], float, int]:
    """Which points tell places of the part, how far apart those that are numbered are at least, m, and how many points
    are stray."""
    if len(place) == 0:
        return np.zeros(0, dtype=np.int64), 1.0, 0
    near = ~far_off(what.value)
    extent = np.ptp(place[near] if near.any() else place, axis=0)
    apart = 1e-3 * max(float(np.linalg.norm(extent)) / 6.0, 1e-6)
    stray = off_the_part(what.points, what.value, apart)
    named = ~stray if what.no_place is None else ~(stray | what.no_place)
    return np.flatnonzero(named), apart, int(stray.sum())


def _point_at(axes: Any, what: DeviationMap, place: Float, named: NDArray[np.int64], apart: float) -> None:
    """The largest places, numbered, with their median deviation."""
    if len(named) == 0:
        return
    found = [(int(named[i]), value) for i, value in callouts(what.points[named], what.value[named], CALLOUTS, apart)]
    texts = [f"{i}: {value * 1e6:+.{_places(value)}f} µm" for i, (_, value) in enumerate(found, 1)]
    px = axes.figure.dpi / 72.0  # of a typographic point
    anchors = axes.transData.transform(place[[i for i, _ in found]].reshape(-1, 2)) / px
    sizes = np.array([text_size(text, LABEL_PT) for text in texts]).reshape(-1, 2) + FRAME * LABEL_PT
    low, high = axes.get_window_extent().get_points() / px
    middles = label_places(anchors, sizes, low, high, gap=3.0)
    for (i, _), text, offset in zip(found, texts, middles - anchors, strict=True):
        axes.annotate(
            text, place[i], xytext=tuple(offset.tolist()), textcoords="offset points", ha="center", va="center",
            fontsize=LABEL_PT, color=INK, bbox={"boxstyle": "round,pad=0.25", "fc": "white", "ec": INK, "lw": 0.5},
            arrowprops={"arrowstyle": "-", "color": INK, "lw": 0.6}, annotation_clip=False,
        )  # fmt: skip


def _places(value: float) -> int:
    return 0 if abs(value) >= 1e-4 else 1 if abs(value) >= 1e-5 else 2


def _axes(towards: Float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Right and up of who looks at the part along -towards, world z up as far as it can be."""
    out = towards / max(float(np.linalg.norm(towards)), 1e-300)
    pole = np.array([0.0, 0.0, 1.0]) if abs(out[2]) < math.cos(math.radians(20.0)) else np.array([0.0, 1.0, 0.0])
    across = np.cross(pole, out)
    across /= np.linalg.norm(across)
    return across, np.cross(out, across)
