"""The chart of a study as pixels in the window's size and colours, and where its spots are: the headless figure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.report.colour import GRID, INK, MUTED
from studio.qt.core.theme import Colours
from studio.study.answers import Answer
from studio.study.charts import chart, places

DPI = 118.0
"""Figures are set in 7 to 8 points: as large as the window's own text."""
LEAST = 160
"""px a side, below which no figure can be laid out."""


@dataclass(frozen=True)
class Drawing:
    """pixels (h, w, 4) uint8 RGBA; spots (n, 2) px from the upper left of the widget, NaN where not drawn."""

    pixels: NDArray[np.uint8]
    spots: NDArray[np.float64]
    ratio: float
    """Device pixels a pixel of the widget."""


def draw(answer: Answer, labels: dict[str, str], size: tuple[int, int], ratio: float, colours: Colours) -> Drawing:
    """size: width and height of the widget, px."""
    width, height = (max(LEAST, side) for side in size)
    made = chart(answer, labels, (width / DPI, height / DPI))
    _recolour(made, colours)
    made.set_size_inches(width / DPI, height / DPI)
    made.set_dpi(DPI * ratio)
    made.canvas.draw()
    pixels = np.array(made.canvas.buffer_rgba(), dtype=np.uint8)
    spots = made.axes[0].transData.transform(places(answer)) / ratio
    spots[:, 1] = pixels.shape[0] / ratio - spots[:, 1]
    return Drawing(pixels, spots, ratio)


def _recolour(made: Any, colours: Colours) -> None:
    """Ink and paper become those of the theme; what means something keeps its colour."""
    from matplotlib.colors import to_hex

    inks = {INK: colours.text, MUTED: colours.muted, GRID: colours.line, "#b6bfc8": colours.line}
    made.set_facecolor(colours.base)
    for axes in made.axes:
        axes.set_facecolor(colours.base)
        axes.tick_params(which="both", labelcolor=colours.muted, color=colours.line)
        for spine in axes.spines.values():
            spine.set_edgecolor(colours.line)
        for line in (*axes.xaxis.get_gridlines(), *axes.yaxis.get_gridlines()):
            line.set_color(colours.line)
        for text in (axes.xaxis.label, axes.yaxis.label, axes.title, axes._left_title, *axes.texts):
            text.set_color(inks.get(to_hex(text.get_color()), text.get_color()))
        for line in axes.lines:
            line.set_color(inks.get(to_hex(line.get_color()), line.get_color()))
            line.set_markeredgecolor(inks.get(to_hex(line.get_markeredgecolor()), line.get_markeredgecolor()))
        legend = axes.get_legend()
        for text in legend.get_texts() if legend is not None else ():
            text.set_color(colours.text)
