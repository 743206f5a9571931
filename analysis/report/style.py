"""How figures look and how they get into the page: one style, drawn with Agg, inlined as PNG."""

from __future__ import annotations

import base64
import io
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.report.colour import GRID, INK, MUTED

WIDTH = 6.9
"""inch: the text width of the page."""
DPI = 200
RC: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib: the same on every machine
    "font.size": 7.5,
    "axes.titlesize": 8,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 6,
    "axes.labelsize": 7.5,
    "axes.labelcolor": MUTED,
    "axes.edgecolor": "#b6bfc8",
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "grid.color": GRID,
    "grid.linewidth": 0.5,
    "text.color": INK,
    "text.parse_math": False,  # names are text, not formulas
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "xtick.major.size": 0,
    "ytick.major.size": 0,
    "legend.frameon": False,
    "legend.fontsize": 7,
    "legend.handlelength": 1.4,
    "lines.solid_capstyle": "round",
    "path.simplify": True,
    "savefig.facecolor": "white",
}


@contextmanager
def figure(height: float, width: float = WIDTH) -> Iterator[Any]:
    """A matplotlib figure, inches, in the report's style; no global state, no window."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with matplotlib.rc_context(RC):
        made = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(made)
        yield made


def png_uri(made: Any, dpi: int = DPI) -> str:
    """data: URI of a figure."""
    made.set_dpi(dpi)
    made.canvas.draw()
    return image_uri(np.asarray(made.canvas.buffer_rgba())[:, :, :3])


def image_uri(pixels: NDArray[np.uint8]) -> str:
    """data: URI of (h, w, 3) pixels."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(buffer, "PNG", compress_level=4)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def plain(text: str) -> str:
    """Text fit for a page and a font: no control or direction characters, no lone surrogates."""
    return "".join(" " if unicodedata.category(letter) in ("Cc", "Cf", "Cs") else letter for letter in text)


def short(text: str, length: int = 28) -> str:
    """The same, cut for a legend."""
    text = plain(text)
    return text if len(text) <= length else text[: length - 1] + "…"
